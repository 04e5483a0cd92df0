#include "fusion/pose/odometry/scan_motion.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::pose {
namespace {

constexpr double kLongest = 0.5;  // s between two scans, and from the last one to a prediction
constexpr double kMemory = 16;    // scans
constexpr int kEnough = 8;        // comparisons before a choice
constexpr double kLever = 5;  // m: where the errors of position and heading are weighed against each other
constexpr double kClearly = 0.6;  // of odometry's mean square error

constexpr double kSlow = 0.1, kSlowTurn = 0.1;  // m/s, rad/s: below, errors do not depend on the speed

double speed_squared(const Twist2& twist) {
  return twist.vx * twist.vx + twist.vy * twist.vy + kSlow * kSlow;
}
double yaw_rate_squared(const Twist2& twist) { return twist.wz * twist.wz + kSlowTurn * kSlowTurn; }

}  // namespace

double ScanMotion::Errors::at_distance() const { return position + kLever * kLever * yaw; }

void ScanMotion::learn(const Pose2& found, const Pose2& predicted, double dt, Errors& errors) const {
  const double weight = std::max(1 / kMemory, 1.0 / (learned_ + 1));
  const double angle = wrap_angle(found.yaw - predicted.yaw);
  const double square = (found.position() - predicted.position()).squaredNorm();
  const auto average = [&](double value, double& mean) { mean += weight * (value / (dt * dt) - mean); };
  average(square, errors.position);
  average(angle * angle, errors.yaw);
  average(square / speed_squared(*twist_), errors.position_by_speed);
  average(angle * angle / yaw_rate_squared(*twist_), errors.yaw_by_speed);
}

void ScanMotion::choose() {
  const double ours = constant_velocity_.at_distance(), theirs = odometry_.at_distance();
  if (preferred_) {
    preferred_ = ours < theirs;
  } else {
    preferred_ = learned_ >= kEnough && ours < kClearly * theirs;
  }
}

void ScanMotion::add(SensorTime stamp, const Pose2& T_map_base, const std::optional<Pose2>& by_odometry) {
  const double dt = stamp_ ? (stamp - *stamp_).seconds() : 0;
  const bool follows = dt > 0 && dt <= kLongest;
  if (follows && twist_ && by_odometry) {
    learn(T_map_base, last_ * moved(*twist_, dt), dt, constant_velocity_);
    learn(T_map_base, *by_odometry, dt, odometry_);
    learned_ = std::min(learned_ + 1, 1000);
    choose();
  }
  twist_ = follows ? std::optional(twist_between(last_, T_map_base, dt)) : std::nullopt;
  step_ = dt;
  stamp_ = stamp;
  last_ = T_map_base;
}

std::optional<ScanMotion::Step> ScanMotion::last_step() const {
  if (!twist_) return std::nullopt;
  return Step{*stamp_, last_, *twist_, step_};
}

std::optional<ScanMotion::Prediction> ScanMotion::at(SensorTime t) const {
  if (!stamp_ || !twist_) return std::nullopt;
  const double dt = (t - *stamp_).seconds();
  if (std::abs(dt) > kLongest) return std::nullopt;
  const Errors& errors = constant_velocity_;
  const double position = std::max(errors.position, errors.position_by_speed * speed_squared(*twist_));
  const double yaw = std::max(errors.yaw, errors.yaw_by_speed * yaw_rate_squared(*twist_));
  return Prediction{moved(*twist_, dt), *twist_, position / 2 * dt * dt, yaw * dt * dt};
}

}  // namespace parhelion::pose
