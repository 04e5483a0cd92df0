// Errors of estimates against true poses, and whether their covariances hold them.
#pragma once

#include <Eigen/LU>
#include <cstddef>
#include <vector>

#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::test {

/// chi^2 below which 95 % of errors are: of two and three degrees of freedom.
constexpr double kInside2 = 5.991, kInside3 = 7.815;

/// Of x, y, yaw; map frame.
inline Eigen::Matrix3d planar_covariance(const PoseEstimate& estimate) {
  constexpr int rows[] = {0, 1, 5};
  return estimate.covariance(rows, rows);
}

inline Eigen::Vector3d planar_error(const Pose2& estimate, const Pose2& truth) {
  return {estimate.x - truth.x, estimate.y - truth.y, wrap_angle(estimate.yaw - truth.yaw)};
}

/// The error lies in the 95 % ellipse: of x and y, and of x, y and yaw.
inline bool holds_position(const Eigen::Matrix3d& covariance, const Eigen::Vector3d& error) {
  const Eigen::Matrix2d position = covariance.topLeftCorner<2, 2>();
  return error.head<2>().dot(position.inverse() * error.head<2>()) <= kInside2;
}
inline bool holds_pose(const Eigen::Matrix3d& covariance, const Eigen::Vector3d& error) {
  return error.dot(covariance.inverse() * error) <= kInside3;
}

struct EstimateErrors {
  std::vector<double> distances;  ///< m
  std::size_t inside_position = 0, inside_pose = 0;

  void add(const Eigen::Matrix3d& covariance, const Eigen::Vector3d& error) {
    distances.push_back(error.head<2>().norm());
    inside_position += holds_position(covariance, error) ? 1 : 0;
    inside_pose += holds_pose(covariance, error) ? 1 : 0;
  }
  void add(const PoseEstimate& estimate, const Pose2& truth) {
    add(planar_covariance(estimate), planar_error(planar(estimate.T_map_base), truth));
  }
};

}  // namespace parhelion::test
