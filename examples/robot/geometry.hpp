// Poses in the plane. T_a_b is b's pose in a, and turns coordinates in b into coordinates in a.
#pragma once

#include <cmath>
#include <vector>

namespace robot {

constexpr double kPi = 3.14159265358979323846;

struct Point2 {
  double x = 0, y = 0;  // m
};
using Polygon = std::vector<Point2>;  // convex, counter-clockwise

struct Pose2 {
  double x = 0, y = 0, yaw = 0;  // m, rad
};

struct Twist2 {
  double vx = 0, wz = 0;  // m/s forward, rad/s counter-clockwise; of base_link
};

inline double wrap(double angle) { return std::remainder(angle, 2 * kPi); }

inline Point2 operator*(const Pose2& T_a_b, const Point2& p_b) {
  const double c = std::cos(T_a_b.yaw), s = std::sin(T_a_b.yaw);
  return {T_a_b.x + c * p_b.x - s * p_b.y, T_a_b.y + s * p_b.x + c * p_b.y};
}

inline Pose2 operator*(const Pose2& T_a_b, const Pose2& T_b_c) {
  const Point2 p = T_a_b * Point2{T_b_c.x, T_b_c.y};
  return {p.x, p.y, T_a_b.yaw + T_b_c.yaw};
}

inline Pose2 inverse(const Pose2& T_a_b) {
  const double c = std::cos(T_a_b.yaw), s = std::sin(T_a_b.yaw);
  return {-c * T_a_b.x - s * T_a_b.y, s * T_a_b.x - c * T_a_b.y, -T_a_b.yaw};
}

// Where a body at `T` is after `dt` s of `twist`: along an arc.
inline Pose2 advance(const Pose2& T, const Twist2& twist, double dt) {
  const double middle = T.yaw + twist.wz * dt / 2, length = twist.vx * dt;
  return {T.x + length * std::cos(middle), T.y + length * std::sin(middle), T.yaw + twist.wz * dt};
}

inline double distance(const Point2& a, const Point2& b) { return std::hypot(a.x - b.x, a.y - b.y); }

// m from the outline to a point; 0 inside.
inline double distance(const Polygon& outline, const Point2& p) {
  double nearest = 1e9;
  bool inside = true;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Point2 &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const double dx = b.x - a.x, dy = b.y - a.y;
    inside = inside && dx * (p.y - a.y) - dy * (p.x - a.x) >= 0;
    const double s = ((p.x - a.x) * dx + (p.y - a.y) * dy) / (dx * dx + dy * dy);
    const double part = s < 0 ? 0 : s > 1 ? 1 : s;
    nearest = std::fmin(nearest, distance(p, {a.x + part * dx, a.y + part * dy}));
  }
  return inside ? 0 : nearest;
}

}  // namespace robot
