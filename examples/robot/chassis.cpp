#include "chassis.hpp"

#include <algorithm>

#include "description.hpp"

namespace robot {
namespace {

constexpr double kSlipTime = 1.5;  // s in which a wheel's slip changes

double towards(double value, double wanted, double change) {
  return value + std::clamp(wanted - value, -change, change);
}

}  // namespace

// The slip is a first-order Gauss-Markov process.
double Chassis::rolled(Wheel& wheel, double speed, double dt) {
  std::normal_distribution<double> gaussian;
  wheel.slip += -wheel.slip * dt / kSlipTime + slip_ * std::sqrt(2 * dt / kSlipTime) * gaussian(random_);
  wheel.turned += speed * dt / kWheelRadius;
  return speed * dt * (1 - wheel.slip);
}

void Chassis::step(const Twist2& command, double dt, const Building& building) {
  const double vx = std::clamp(command.vx, -kMaxSpeed, kMaxSpeed);
  const double wz = std::clamp(command.wz, -kMaxYawRate, kMaxYawRate);
  twist_.vx = towards(twist_.vx, vx, kDeceleration * dt);
  twist_.wz = towards(twist_.wz, wz, kYawDeceleration * dt);
  const double left = rolled(left_, twist_.vx - twist_.wz * kTrack / 2, dt);
  const double right = rolled(right_, twist_.vx + twist_.wz * kTrack / 2, dt);
  const Pose2 next = advance(T_site_base_, {(left + right) / 2, (right - left) / kTrack}, 1);
  const bool was_blocked = blocked_;
  blocked_ = building.touches(next, kFootprint, kHeight);
  if (blocked_) {
    twist_ = {};  // the motors stall
    if (!was_blocked) ++bumps_;
    return;
  }
  driven_ += distance(Point2{next.x, next.y}, Point2{T_site_base_.x, T_site_base_.y});
  T_site_base_ = next;
}

double Chassis::measured(Wheel& wheel) {
  const long ticks = std::lround(std::floor(wheel.turned / (2 * kPi) * kTicksPerTurn));
  const double length = static_cast<double>(ticks - wheel.ticks) / kTicksPerTurn * 2 * kPi * kWheelRadius;
  wheel.ticks = ticks;
  return length;
}

Pose2 Chassis::odometry() {
  const double left = measured(left_), right = measured(right_);
  T_odom_base_ = advance(T_odom_base_, {(left + right) / 2, (right - left) / kTrack}, 1);
  return T_odom_base_;
}

}  // namespace robot
