// The lines of a laser that is swept over the site, each where the laser was, collected into views for the
// mapper.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "server/runtime/site_mapper.hpp"
#include "server/tick/pose_path.hpp"

namespace parhelion::runtime {

struct LineSweepOptions {
  /// A line waits this long, so that encoders and odometry around it have come.
  Duration settle = milliseconds(250);
  double drive = 1.0, turn = 1.0;  ///< m and rad that the laser moves while lines go to one view
  /// A line from nearer by than both adds nothing: a laser at rest makes no view.
  double least_move = 0.005, least_turn = 0.003;  ///< m, rad
  /// Lines further apart than either are of two views.
  double leap = 0.5;  ///< m
  Duration silence = seconds(2.0);
  std::size_t least_lines = 20;  ///< of a view
};

/// One thread, the loop's: what it costs there is two poses a line; points are made on the mapper's thread.
class LineSweep {
 public:
  LineSweep(const LineLaserDescription& laser, const RobotDescription& robot,
            const LineSweepOptions& options = {});

  /// A line as it came. A stamp that is not later than the one before starts anew.
  void add(const Scan& line);
  /// A whole view, where the lines that have settled end one. A line for which
  /// the robot's poses and encoders have none is left out.
  std::optional<LineView> take(const tick::PoseState& robot);
  std::uint64_t left_out() const { return left_out_; }

 private:
  std::optional<cloud::PlacedLine> placed(const tick::PoseState& robot, Scan line) const;
  std::optional<LineView> keep(cloud::PlacedLine line);
  LineView start_anew();

  static constexpr std::size_t most_waiting = 1024;
  LineLaserDescription laser_;
  LineSweepOptions options_;
  std::deque<Scan> waiting_;  // oldest first
  LineView growing_;
  double driven_ = 0, turned_ = 0;  // m, rad, since the view's first line
  std::uint64_t left_out_ = 0;
};

}  // namespace parhelion::runtime
