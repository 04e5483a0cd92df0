// Poses and motions in the plane: x, y in metres, yaw in radians.
#pragma once

#include <cmath>

#include "protocols/frames.hpp"

namespace parhelion {

/// A planar pose of b in a, as T_a_b; the variable's name gives the frames.
struct Pose2 {
  double x = 0;
  double y = 0;
  double yaw = 0;

  Eigen::Vector2d position() const { return {x, y}; }
  Eigen::Vector2d operator*(const Eigen::Vector2d& p_b) const {
    const double c = std::cos(yaw), s = std::sin(yaw);
    return {x + c * p_b.x() - s * p_b.y(), y + s * p_b.x() + c * p_b.y()};
  }
  Pose2 operator*(const Pose2& T_b_c) const {
    const Eigen::Vector2d p = *this * T_b_c.position();
    return {p.x(), p.y(), wrap_angle(yaw + T_b_c.yaw)};
  }
  Pose2 inverse() const {
    const double c = std::cos(yaw), s = std::sin(yaw);
    return {-c * x - s * y, s * x - c * y, -yaw};
  }
  bool finite() const { return std::isfinite(x) && std::isfinite(y) && std::isfinite(yaw); }
};

template <class A, class B>
Pose2 planar(const Transform<A, B>& T_a_b) {
  return {T_a_b.translation().x(), T_a_b.translation().y(), T_a_b.yaw()};
}

template <class A, class B>
Transform<A, B> transform(const Pose2& pose) {
  return Transform<A, B>::planar(pose.x, pose.y, pose.yaw);
}

/// The constant twist that leads from the identity to `pose` in one second (logarithm of SE(2)).
inline Twist2 twist_to(const Pose2& pose) {
  const double half = pose.yaw / 2;
  // half * cot(half), by its series where the quotient would lose precision.
  const double a = std::abs(half) < 1e-4 ? 1 - half * half / 3 : half / std::tan(half);
  return {a * pose.x + half * pose.y, -half * pose.x + a * pose.y, pose.yaw};
}

/// The pose after `dt` seconds of the twist (exponential of SE(2)); yaw is not wrapped.
inline Pose2 moved(const Twist2& twist, double dt) {
  const double yaw = twist.wz * dt;
  const double s = std::abs(yaw) < 1e-4 ? 1 - yaw * yaw / 6 : std::sin(yaw) / yaw;
  const double c = std::abs(yaw) < 1e-4 ? yaw / 2 : (1 - std::cos(yaw)) / yaw;
  return {(s * twist.vx - c * twist.vy) * dt, (c * twist.vx + s * twist.vy) * dt, yaw};
}

/// The constant twist, body frame, that leads from a to b in `dt` seconds.
inline Twist2 twist_between(const Pose2& a, const Pose2& b, double dt) {
  const Twist2 step = twist_to(a.inverse() * b);
  return {step.vx / dt, step.vy / dt, step.wz / dt};
}

/// Between a (s = 0) and b (s = 1) along the arc of constant twist; extrapolates beyond.
inline Pose2 interpolate(const Pose2& a, const Pose2& b, double s) {
  return a * moved(twist_to(a.inverse() * b), s);
}

}  // namespace parhelion
