// Odometry drift between two SLAM estimates, learned from SLAM's corrections.
#pragma once

#include "protocols/robot.hpp"

namespace parhelion::pose {

/// The drift stated in the robot description is a lower bound: slipping wheels or jittering stamps show in
/// the corrections, and the predicted error of a return must not be smaller than the observed one. Errors are
/// taken as proportional to the distance driven (heading: plus the part due to turning); their squares are
/// averaged over about the last `memory` corrections. Never allocates.
class OdometryDrift {
 public:
  explicit OdometryDrift(const RobotDescription& robot);

  /// One correction after `driven` m and `turned` rad: its length (m) and rotation (rad), and the variances
  /// (m^2 along one axis, rad^2) of the two SLAM estimates themselves.
  struct Correction {
    double driven = 0, turned = 0;
    double distance = 0, angle = 0;
    double position_variance = 0, yaw_variance = 0;
  };
  void learn(const Correction& correction);
  void forget();

  double position_variance(double driven) const;            ///< m^2 along one axis
  double yaw_variance(double driven, double turned) const;  ///< rad^2

  static constexpr double kMemory = 32;  ///< corrections

 private:
  double stated_position_, stated_yaw_;  ///< 1 sigma per metre, per radian
  double driven_squared_ = 0, position_ = 0,
         yaw_ = 0;  ///< exponentially decayed sums of squares: m^2, m^2, rad^2
};

}  // namespace parhelion::pose
