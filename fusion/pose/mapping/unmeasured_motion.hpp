// The way that a robot may have driven while neither scans nor odometry measured it.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "fusion/pose/odometry/abrupt_stop.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// In a corridor without features only odometry measures the distance. If odometry has a fault, or stops more
/// abruptly than a robot can brake, the robot may have driven on at its previous speed.
class UnmeasuredMotion {
 public:
  void add(const Odometry& odometry) { stop_.add(odometry); }
  /// At each scan. `shown`: information (x, y, yaw, map frame) of its points about `T_map_base`.
  /// `by_odometry`: the pose follows odometry. `speed`: m/s, as the scans so far showed it. `error`: of the
  /// position so far, m, 1 sigma, map frame. Returns what to add to that error since the previous scan.
  /// Independent errors do not cancel, and beyond some 30 m nothing is added. The addition is reversed if the
  /// robot itself seems to have stopped (AbruptStop::was_true).
  Eigen::Vector2d add(SensorTime stamp, const Pose2& T_map_base, const Eigen::Matrix3d& shown,
                      bool by_odometry, double speed, const Eigen::Vector2d& error);
  /// For longer than a moment.
  bool is_unmeasured() const;
  /// The pose was determined by other means: starts anew.
  void forget();

 private:
  AbruptStop stop_;
  std::optional<SensorTime> before_, measured_;           ///< stamps of scans
  Eigen::Vector2d since_stop_ = Eigen::Vector2d::Zero();  ///< m, map frame
};

}  // namespace parhelion::pose
