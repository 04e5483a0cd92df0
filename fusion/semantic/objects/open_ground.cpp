#include "fusion/semantic/objects/open_ground.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fusion/semantic/build_model.hpp"

namespace parhelion::semantic {

OpenGround::OpenGround(const std::vector<ModelEntity>& entities) {
  constexpr double kWide = 120;  // m^2
  double grounds = 0;
  bool ceiling = false;  // a level one: a shed's roof or the underside of stairs stands in the open
  for (const ModelEntity& e : entities) {
    if (is_ground(e.label)) grounds += e.size.head<2>().prod();
    ceiling = ceiling || (e.label == EntityLabel::ceiling && is_level(e));
    if (e.label != EntityLabel::wall) continue;
    const Eigen::Vector3d half(0.5 * e.size.x(), 0, 0);
    walls_.push_back({(e.T_map_body * Eigen::Vector3d(-half)).head<2>(), (e.T_map_body * half).head<2>()});
  }
  wide_ = grounds > kWide && !ceiling;
}

bool OpenGround::contains(const Eigen::Vector2d& p) const {
  constexpr int kDirections = 16;
  constexpr double kNear = 8;  // m
  if (!wide_) return false;
  const auto cross = [](const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
    return u.x() * v.y() - u.y() * v.x();
  };
  int walled = 0;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 2 * std::numbers::pi * k / kDirections;
    const Eigen::Vector2d ray(kNear * std::cos(angle), kNear * std::sin(angle));
    walled += std::any_of(walls_.begin(), walls_.end(), [&](const Segment& wall) {
      const Eigen::Vector2d along = wall.b - wall.a, from = wall.a - p;
      const double det = cross(ray, along);
      const double t = cross(from, along) / det, s = cross(from, ray) / det;
      return t >= 0 && t <= 1 && s >= 0 && s <= 1;
    });
  }
  return 2 * walled < kDirections;
}

}  // namespace parhelion::semantic
