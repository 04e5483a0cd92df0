#include "fusion/pose/odometry/odometry_drift.hpp"

#include <algorithm>

namespace parhelion::pose {
namespace {

constexpr double kMinDriven = 0.02;  // m: a robot at rest gives no information about its odometry
constexpr double kStatedWeight = 8;  // initial weight of the description's value, in corrections

constexpr double squared(double x) { return x * x; }

}  // namespace

OdometryDrift::OdometryDrift(const RobotDescription& robot)
    : stated_position_(robot.odometry_error_translation), stated_yaw_(robot.odometry_error_rotation) {}

void OdometryDrift::learn(const Correction& correction) {
  if (correction.driven < kMinDriven) return;
  const double driven_squared = squared(correction.driven);
  if (driven_squared_ == 0) {
    driven_squared_ = kStatedWeight * driven_squared;
    position_ = squared(stated_position_) * driven_squared_;
  }
  constexpr double kept = 1 - 1 / kMemory;
  driven_squared_ = kept * driven_squared_ + driven_squared;
  position_ =
      kept * position_ + std::max(0.0, squared(correction.distance) / 2 - correction.position_variance);
  yaw_ = kept * yaw_ + std::max(0.0, squared(correction.angle) - squared(stated_yaw_ * correction.turned) -
                                         correction.yaw_variance);
}

void OdometryDrift::forget() { driven_squared_ = position_ = yaw_ = 0; }

double OdometryDrift::position_variance(double driven) const {
  const double learned = driven_squared_ > 0 ? position_ / driven_squared_ : 0;
  return std::max(squared(stated_position_), learned) * squared(driven);
}

double OdometryDrift::yaw_variance(double driven, double turned) const {
  const double learned = driven_squared_ > 0 ? yaw_ / driven_squared_ : 0;
  return squared(stated_yaw_ * turned) + learned * squared(driven);
}

}  // namespace parhelion::pose
