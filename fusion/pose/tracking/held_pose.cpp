#include "fusion/pose/tracking/held_pose.hpp"

#include <Eigen/LU>
#include <cmath>

namespace parhelion::pose {

Estimate2 HeldPose::after(const Estimate2& before, const ScanTracking::Followed& found, const Pose2& step) {
  const ScanTracking::Where& expected = found.expected;
  Estimate2 predicted{expected.T_map_base, expected.covariance};
  double fresh = 1;
  if (found.by_odometry) {
    belief_.add(before.T_map_base, expected.T_map_base, found.match);
    if (belief_.is_good()) {
      const double driven = step.position().norm();
      Eigen::Matrix3d odometry = odometry_covariance(robot_, driven, std::abs(step.yaw));
      odometry(0, 0) = odometry(1, 1) = belief_.variance(driven);
      predicted.covariance =
          propagated_covariance(before.covariance, before.T_map_base, expected.T_map_base, odometry);
      fresh = new_fraction(step, options_.renewed_after);
    }
  }
  return joined(predicted, expected.covariance.inverse(), found.match.T_map_base, found.match.information,
                fresh, options_.strong_sigma);
}

}  // namespace parhelion::pose
