// Converts a planar match to a 3D pose estimate.
#pragma once

#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// `covariance`: x, y, yaw. The other components get the sigma of the level-floor assumption: 1 cm of height,
/// 0.6 degrees of roll and pitch.
inline PoseEstimate planar_estimate(SensorTime stamp, const Pose2& T_map_base,
                                    const Eigen::Matrix3d& covariance, SlamState state) {
  PoseEstimate estimate;
  estimate.stamp = stamp;
  estimate.T_map_base = transform<Map, Base>(T_map_base);
  estimate.covariance.diagonal() << 0, 0, 1e-4, 1e-4, 1e-4, 0;
  constexpr int rows[] = {0, 1, 5};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      estimate.covariance(rows[i], rows[j]) = 0.5 * (covariance(i, j) + covariance(j, i));
  }
  // The map's own accuracy bounds that of a match: 5 mm and 0.1 degrees.
  estimate.covariance(0, 0) += 2.5e-5;
  estimate.covariance(1, 1) += 2.5e-5;
  estimate.covariance(5, 5) += 3e-6;
  estimate.state = state;
  return estimate;
}

}  // namespace parhelion::pose
