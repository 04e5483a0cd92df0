#include "fusion/pose/carry_error.hpp"

#include <algorithm>

namespace parhelion::pose {
namespace {

constexpr double shortest_way = 0.02;  // m: a robot at rest gives no information about its odometry
constexpr double stated_weight = 8;    // initial weight of the description's value, in corrections

constexpr double squared(double x) { return x * x; }

}  // namespace

CarryError::CarryError(const RobotDescription& robot)
    : stated_position_(robot.odometry_error_translation), stated_yaw_(robot.odometry_error_rotation) {}

void CarryError::learn(const Correction& correction) {
  if (correction.driven < shortest_way) return;
  const double way = squared(correction.driven);
  if (way_ == 0) {
    way_ = stated_weight * way;
    position_ = squared(stated_position_) * way_;
  }
  constexpr double kept = 1 - 1 / memory;
  way_ = kept * way_ + way;
  position_ =
      kept * position_ + std::max(0.0, squared(correction.distance) / 2 - correction.position_variance);
  yaw_ = kept * yaw_ + std::max(0.0, squared(correction.angle) - squared(stated_yaw_ * correction.turned) -
                                         correction.yaw_variance);
}

void CarryError::forget() { way_ = position_ = yaw_ = 0; }

double CarryError::position_variance(double driven) const {
  const double learned = way_ > 0 ? position_ / way_ : 0;
  return std::max(squared(stated_position_), learned) * squared(driven);
}

double CarryError::yaw_variance(double driven, double turned) const {
  const double learned = way_ > 0 ? yaw_ / way_ : 0;
  return squared(stated_yaw_ * turned) + learned * squared(driven);
}

}  // namespace parhelion::pose
