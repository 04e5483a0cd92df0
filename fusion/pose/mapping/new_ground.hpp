// Ground that the map does not reach, and that a robot came to without seeing anything on the way: over an
// open place, or through a gap of the log. The map explains nothing there. Where successive scans and
// odometry agree with each other, the map may go on.
#pragma once

#include <optional>

#include "fusion/pose/matching/scan_match.hpp"
#include "fusion/pose/matching/scan_points.hpp"

namespace parhelion::pose {

class NewGround {
 public:
  explicit NewGround(double cell) : cell_(cell) {}

  /// After a scan that the map does not explain. `T_map_base`: by odometry alone since the last scan that it
  /// explained. True: scans and odometry have agreed for long enough, the last one included.
  bool add(const ScanPoints& scan, const Pose2& T_map_base, const MatchOptions& options);
  /// The map explains the scan, or odometry is in doubt.
  void forget() { first_.reset(); }

 private:
  void begin(const ScanPoints& scan, const Pose2& T_map_base);

  double cell_;                     ///< m
  std::optional<SurfelMap> first_;  ///< what the first of these scans saw
  Pose2 T_map_first_;               ///< the base at that scan
};

}  // namespace parhelion::pose
