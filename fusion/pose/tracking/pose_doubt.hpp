// Reasons to doubt a pose that matches the map: a robot that was picked up and put down in a place that looks
// much like the one before, or is being carried.
#pragma once

#include <optional>

#include "fusion/pose/matching/scan_change.hpp"
#include "fusion/pose/matching/scan_points.hpp"
#include "fusion/pose/odometry/scan_odometry.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

class PoseDoubt {
 public:
  /// After each scan. `T_map_before`: the pose at the previous one. `of_usual`: what the map explains of this
  /// scan, as a fraction of what it usually explains.
  void add(const ScanPoints& scan, const Pose2& T_map_before, const Pose2& T_map_now,
           const ScanOdometry::Step& odometry, double of_usual);
  /// The pose was set anew.
  void forget();

  /// From the previous scan to this one, everything around has changed: people who come and go do not explain
  /// it, and neither does the motion that the match or odometry shows.
  bool displaced() const { return displaced_; }
  /// Within the last second, the scans have shown a motion that odometry has not.
  bool moved_otherwise() const;
  /// The same, and the wheels stand still, or nothing is known of them.
  bool carried() const;

 private:
  PreviousScan previous_;
  SensorTime now_;  ///< stamp of the last scan
  bool displaced_ = false;
  Eigen::Vector2d unexplained_ = Eigen::Vector2d::Zero();  ///< m, of the motion of the last second, map frame
  double unexplained_yaw_ = 0;                             ///< rad, the same
  double driven_ = 0, turned_ = 0;                         ///< m, rad, by odometry, in that time
  double just_driven_ = 0;                                 ///< m and rad, by odometry, of the last moments
  bool still_ = false;
  std::optional<SensorTime> moved_otherwise_;  ///< the last scan at which that was much
};

}  // namespace parhelion::pose
