#include "fusion/pose/matching/weak_directions.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace parhelion::pose {
namespace {

constexpr double kLever = 5;         ///< m: rotations are compared as distances there
constexpr double kAlwaysNew = 0.02;  ///< people walk while the robot stands

constexpr double squared(double x) { return x * x; }

}  // namespace

double new_fraction(const Pose2& step, double metres) {
  return std::clamp((step.position().norm() + std::abs(step.yaw)) / metres, kAlwaysNew, 1.0);
}

Eigen::Matrix3d strong_directions(const Eigen::Matrix3d& information, double sigma) {
  const Eigen::DiagonalMatrix<double, 3> scale(1, 1, kLever), inverse_scale(1, 1, 1 / kLever);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(inverse_scale * information * inverse_scale);
  Eigen::Vector3d strength;  // 1 where surfaces determine the direction, 0 where they do not
  for (int i = 0; i < 3; ++i) {
    const double determined = squared(std::max(0.0, axes.eigenvalues()[i]) * squared(sigma));
    strength[i] = determined / (determined + 1);
  }
  return inverse_scale * axes.eigenvectors() * strength.asDiagonal() * axes.eigenvectors().transpose() *
         scale;
}

Estimate2 joined(const Estimate2& predicted, const Eigen::Matrix3d& prior, const Pose2& matched,
                 const Eigen::Matrix3d& information, double fresh, double sigma) {
  const Eigen::Matrix3d strong = strong_directions(information, sigma);
  const Eigen::Matrix3d weak = Eigen::Matrix3d::Identity() - strong;
  const Pose2& from = predicted.T_map_base;
  const Eigen::Vector3d off(matched.x - from.x, matched.y - from.y, wrap_angle(matched.yaw - from.yaw));
  // The match is the minimum of prior and points: (prior + information) off = information (their own
  // minimum).
  const Eigen::Matrix3d matched_covariance = (prior + information).inverse();
  const Eigen::Matrix3d held_covariance = (predicted.covariance.inverse() + fresh * information).inverse();
  const Eigen::Vector3d held = held_covariance * (fresh * ((prior + information) * off));
  const Eigen::Vector3d step = strong * off + weak * held;
  const Eigen::Matrix3d covariance =
      strong * matched_covariance * strong.transpose() + weak * held_covariance * weak.transpose();
  return {{from.x + step.x(), from.y + step.y(), wrap_angle(from.yaw + step.z())},
          (covariance + covariance.transpose()) / 2};
}

}  // namespace parhelion::pose
