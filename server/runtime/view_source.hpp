// Selects views of a live session for the site mapper: depth images from new positions, swept scan lines.
#pragma once

#include <optional>
#include <string>

#include "server/runtime/line_sweep.hpp"
#include "server/runtime/site_mapper.hpp"
#include "server/tick/percentiles.hpp"
#include "server/tick/state.hpp"

namespace parhelion::runtime {

/// Used only by the loop's thread. `configuration` must outlive this.
class ViewSource {
 public:
  /// `nice`: as SiteMapper.
  ViewSource(UpdateSite update, const tick::Configuration& configuration, int nice);

  /// After the tick has handled a message: submits its view to the mapper if it is from a new position.
  void offer(tick::InputKind kind, const tick::RobotState& robot);
  /// The oldest model not yet taken.
  std::optional<SiteMapper::Ready> take();
  /// Records how long a new model delayed the loop.
  void held_up(Duration by) { swap_us_.add(by.microseconds()); }
  /// For the report.
  std::string note() const;

 private:
  void offer_depth(const Image& depth, const tick::PoseState& robot);
  void offer_line(LineSweep& sweep, const Scan& line, const tick::PoseState& robot);

  const tick::Configuration& configuration_;
  SiteMapper mapper_;
  std::optional<Transform<Map, DepthOptical>> last_view_;
  std::optional<LineSweep> lines_;       ///< of LINES
  std::optional<LineSweep> scan_lines_;  ///< of SCAN, where its laser is mounted on its side
  tick::Percentiles view_to_model_us_;   ///< outside the tick
  tick::Percentiles swap_us_;            ///< inside the tick
};

}  // namespace parhelion::runtime
