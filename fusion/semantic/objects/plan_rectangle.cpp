#include "fusion/semantic/objects/plan_rectangle.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "protocols/quantile.hpp"

namespace parhelion::semantic {

PlanRectangle plan_rectangle(const std::vector<Eigen::Vector2d>& points, double cell) {
  constexpr int kTurns = 30;
  PlanRectangle rectangle;
  double best = std::numeric_limits<double>::max();
  std::vector<double> s(points.size()), t(points.size());
  for (int k = 0; k < kTurns; ++k) {
    const double yaw = 0.5 * EIGEN_PI * k / kTurns;
    const Eigen::Vector2d along(std::cos(yaw), std::sin(yaw)), across(-along.y(), along.x());
    for (std::size_t i = 0; i < points.size(); ++i) s[i] = along.dot(points[i]), t[i] = across.dot(points[i]);
    const auto [s0, s1] = quantile_range(s, 0.01, 0.99);
    const auto [t0, t1] = quantile_range(t, 0.01, 0.99);
    const double area = (s1 - s0 + cell) * (t1 - t0 + cell);
    if (area > 0.995 * best) continue;
    best = area;
    rectangle.middle = 0.5 * (s0 + s1) * along + 0.5 * (t0 + t1) * across;
    rectangle.length = s1 - s0 + cell, rectangle.width = t1 - t0 + cell, rectangle.yaw = yaw;
  }
  if (rectangle.width <= rectangle.length) return rectangle;
  std::swap(rectangle.width, rectangle.length);
  rectangle.yaw -= 0.5 * EIGEN_PI;
  return rectangle;
}

}  // namespace parhelion::semantic
