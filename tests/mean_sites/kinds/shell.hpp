// What most sites have: a slab, four walls, the path of a camera.
#pragma once

#include <cmath>

#include "tests/mean_sites/mean_site.hpp"

namespace parhelion::test {

/// A floor at 0 and a ceiling at `height` (m; 0: none) over a rectangle of the plan.
inline void draw_slab(SitePen& pen, double x0, double y0, double x1, double y1, double height) {
  pen.box(EntityLabel::floor, {x0, y0, -0.2}, {x1, y1, 0});
  if (height > 0) pen.box(EntityLabel::ceiling, {x0, y0, height}, {x1, y1, height + 0.2});
  pen.site().ceiling = height > 0;
}

/// A room of `w` x `d` m from the origin on, with a door of 0.9 m in its wall at x = 0, `door` m along it.
inline void draw_room(SitePen& pen, double w, double d, double h, double door) {
  draw_slab(pen, -0.2, -0.2, w + 0.2, d + 0.2, h);
  pen.wall_with_door({-0.06, 0}, {-0.06, d}, 0, h, door, 0.9);
  pen.wall({w + 0.06, 0}, {w + 0.06, d}, 0, h);
  pen.wall({-0.12, -0.06}, {w + 0.12, -0.06}, 0, h);
  pen.wall({-0.12, d + 0.06}, {w + 0.12, d + 0.06}, 0, h);
}

/// A camera that is carried around within a rectangle, 1.4 m over `z`.
inline void carry_camera(SitePen& pen, double x0, double y0, double x1, double y1, double z = 0) {
  for (int k = 0; k < 16; ++k) {
    const double a = 2 * EIGEN_PI * k / 16;
    pen.site().path.emplace_back(0.5 * (x0 + x1) + 0.25 * (x1 - x0) * std::cos(a),
                                 0.5 * (y0 + y1) + 0.25 * (y1 - y0) * std::sin(a), z + 1.4);
  }
}

/// A plate `thick` m thick whose lower side goes, over the width from y0 to y1, from height z0 up or down to
/// z1.
inline std::size_t draw_pitched(SitePen& pen, EntityLabel label, double x0, double x1,
                                const Eigen::Vector2d& low, const Eigen::Vector2d& high, double thick) {
  const Eigen::Vector2d d = high - low;
  const double turn = std::atan2(d.y(), d.x()), length = d.norm();
  const std::size_t b = pen.box(label, {0, 0, 0}, {x1 - x0, length, thick});
  const Eigen::Quaterniond R(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitX()));
  const Eigen::Vector3d middle(0.5 * (x0 + x1), 0.5 * (low.x() + high.x()), 0.5 * (low.y() + high.y()));
  const double away = std::cos(turn) < 0 ? -0.5 : 0.5;  // upwards
  pen.site().model.entities[b].T_map_body =
      Transform<Map, Body>(R, middle + R * Eigen::Vector3d(0, 0, away * thick));
  return b;
}

/// A plate of `size` at `middle` whose x axis is turned by `yaw`.
inline std::size_t draw_turned(SitePen& pen, EntityLabel label, const Eigen::Vector3d& middle, double yaw,
                               const Eigen::Vector3d& size) {
  const std::size_t b = pen.box(label, -0.5 * size, 0.5 * size);
  pen.site().model.entities[b].T_map_body =
      Transform<Map, Body>::planar(middle.x(), middle.y(), yaw, middle.z());
  return b;
}

}  // namespace parhelion::test
