// The way that a robot may have driven while neither scans nor odometry measured it.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "fusion/pose/odometry/abrupt_stop.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// Along a bare corridor odometry alone measures the way. Where it has a fault, or has stopped harder than
/// robots brake, the robot may have driven on at the speed that it had.
class UnmeasuredMotion {
 public:
  void add(const Odometry& odometry) { stop_.add(odometry); }
  /// At each scan. `shown`: information (x, y, yaw, map frame) of its points about `T_map_base`.
  /// `by_odometry`: the pose follows odometry. `speed`: m/s, as the scans so far showed it. `error`: of the
  /// position so far, m, 1 sigma, map frame. What is to be added to it since the previous scan: independent
  /// errors do not cancel, and beyond some 30 m nothing is added. It is taken back where a stop seems to have
  /// been the robot's (AbruptStop::was_true).
  Eigen::Vector2d add(SensorTime stamp, const Pose2& T_map_base, const Eigen::Matrix3d& shown,
                      bool by_odometry, double speed, const Eigen::Vector2d& error);
  /// For longer than a moment.
  bool is_unmeasured() const;
  /// The pose has been found otherwise.
  void forget();

 private:
  AbruptStop stop_;
  std::optional<SensorTime> before_, measured_;           ///< stamps of scans
  Eigen::Vector2d since_stop_ = Eigen::Vector2d::Zero();  ///< m, map frame
};

}  // namespace parhelion::pose
