#include "fusion/pose/mapping/unmeasured_motion.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "fusion/pose/matching/weak_directions.hpp"

namespace parhelion::pose {
namespace {

constexpr double kHardlyShown =
    0.05;                          ///< m, as for strong_directions(): chosen on bare corridors and offices
constexpr double kShown = 0.5;     ///< strength of a direction that counts as shown
constexpr double kSlow = 0.2;      ///< m/s: the robot may drive so fast, whatever the scans showed
constexpr double kLongestGap = 2;  ///< s between scans
constexpr double kLargest = 30;    ///< m, of the error: more would say no more
constexpr Duration kMoment = seconds(1.0);

/// Onto the directions that a match does not show, map frame.
Eigen::Matrix2d hidden_directions(const Eigen::Matrix3d& shown) {
  const Eigen::Matrix2d strong = strong_directions(shown, kHardlyShown).topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes((strong + strong.transpose()) / 2);
  Eigen::Matrix2d hidden = Eigen::Matrix2d::Zero();
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector2d axis = axes.eigenvectors().col(i);
    if (axes.eigenvalues()[i] < kShown) hidden += axis * axis.transpose();
  }
  return hidden;
}

}  // namespace

Eigen::Vector2d UnmeasuredMotion::add(SensorTime stamp, const Pose2& T_map_base, const Eigen::Matrix3d& shown,
                                      bool by_odometry, double speed, const Eigen::Vector2d& error) {
  const double dt = before_ ? std::clamp((stamp - *before_).seconds(), 0.0, kLongestGap) : 0;
  before_ = stamp;
  const Eigen::Matrix2d hidden = hidden_directions(shown);
  const bool measured = by_odometry && !stop_.is_stopped();
  if (!measured_ || measured || hidden.isZero()) measured_ = stamp;
  if (measured) {
    const Eigen::Vector2d added = since_stop_;
    since_stop_.setZero();
    return stop_.was_true() ? Eigen::Vector2d(-added) : Eigen::Vector2d(Eigen::Vector2d::Zero());
  }
  const double possible = stop_.is_stopped() ? stop_.speed() : std::max(speed, kSlow);
  const Eigen::Vector2d ahead(std::cos(T_map_base.yaw), std::sin(T_map_base.yaw));
  if (error.norm() > kLargest) return Eigen::Vector2d::Zero();
  Eigen::Vector2d driven = possible * dt * (hidden * ahead);
  if (error.dot(driven) < 0) driven = -driven;
  if (stop_.is_stopped()) since_stop_ += driven;
  return driven;
}

bool UnmeasuredMotion::is_unmeasured() const { return before_ && *before_ - *measured_ > kMoment; }

void UnmeasuredMotion::forget() {
  measured_ = before_;
  since_stop_.setZero();
}

}  // namespace parhelion::pose
