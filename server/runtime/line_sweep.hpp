// Collects the scan lines of a laser that moves over the site, with their poses, into views for the mapper.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "server/runtime/site_mapper.hpp"
#include "server/tick/pose_path.hpp"

namespace parhelion::runtime {

struct LineSweepOptions {
  /// Delay of a line, until the encoder and odometry messages around it have arrived.
  Duration settle = milliseconds(250);
  double drive = 1.0, turn = 1.0;  ///< m and rad that the laser moves within one view
  /// Lines with less motion than both are left out: a laser at rest makes no view.
  double min_travel = 0.005, min_turn = 0.003;  ///< m, rad
  /// A larger step between two lines starts a new view.
  double leap = 0.5;  ///< m
  Duration silence = seconds(2.0);
  std::size_t min_lines = 20;  ///< of a view
};

/// Used only by the loop's thread, at the cost of two poses per line; points are computed on the mapper's
/// thread.
class LineSweep {
 public:
  LineSweep(const LineLaserDescription& laser, const RobotDescription& robot,
            const LineSweepOptions& options = {});

  /// Adds a raw line. A stamp that is not later than the one before starts anew.
  void add(const Scan& line);
  /// A complete view, if the settled lines end one. A line without known robot and encoder poses is left out.
  std::optional<LineView> take(const tick::PoseState& robot);
  std::uint64_t left_out() const { return left_out_; }

 private:
  std::optional<cloud::PlacedLine> placed(const tick::PoseState& robot, Scan line) const;
  std::optional<LineView> keep(cloud::PlacedLine line);
  LineView start_anew();

  static constexpr std::size_t kMaxWaiting = 1024;
  LineLaserDescription laser_;
  LineSweepOptions options_;
  std::deque<Scan> waiting_;  // oldest first
  LineView growing_;
  double driven_ = 0, turned_ = 0;  // m, rad, since the view's first line
  std::uint64_t left_out_ = 0;
};

}  // namespace parhelion::runtime
