#include "fusion/semantic/pictures/plan_outline.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace parhelion::semantic {
namespace {

/// A ring of `radius` about z at height z, in the shape's frame.
void add_ring(std::vector<Eigen::Vector3d>& points, double radius, double z) {
  constexpr int corners = 32;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners;
    points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
}

void add_sphere(std::vector<Eigen::Vector3d>& points, double radius, double z) {
  for (int k = -4; k <= 4; ++k) {
    const double latitude = k * std::numbers::pi / 8;
    add_ring(points, radius * std::cos(latitude), z + radius * std::sin(latitude));
  }
}

std::vector<Eigen::Vector3d> surface_points(ShapeKind kind, const Eigen::Vector3d& size) {
  std::vector<Eigen::Vector3d> points;
  switch (kind) {
    case ShapeKind::box:
    case ShapeKind::mesh:
      for (int i = 0; i < 8; ++i) {
        points.emplace_back(Eigen::Array3d((i & 1) - 0.5, ((i >> 1) & 1) - 0.5, ((i >> 2) & 1) - 0.5) *
                            size.array());
      }
      break;
    case ShapeKind::cylinder:
      add_ring(points, size.x(), size.z() / 2);
      add_ring(points, size.x(), -size.z() / 2);
      break;
    case ShapeKind::sphere:
      add_sphere(points, size.x(), 0);
      break;
    case ShapeKind::capsule:
      add_sphere(points, size.x(), size.z() / 2);
      add_sphere(points, size.x(), -size.z() / 2);
      break;
  }
  return points;
}

Outline seen_from_above(const std::vector<Eigen::Vector3d>& points, const Eigen::Isometry3d& T_map_shape) {
  Outline flat;
  for (const Eigen::Vector3d& p : points) flat.push_back((T_map_shape * p).head<2>());
  return convex_hull(std::move(flat));
}

}  // namespace

Outline outline_of(const ModelEntity& entity) {
  return seen_from_above(surface_points(ShapeKind::box, entity.size), entity.T_map_body.isometry());
}

Outline outline_of(const Shape& shape, const Transform<Map, Body>& T_map_body) {
  return seen_from_above(
      shape.mesh ? hull_corners(shape.mesh->vertices) : surface_points(shape.kind, shape.size),
      (T_map_body * shape.T_body_shape).isometry());
}

std::optional<std::pair<Eigen::Vector2d, Eigen::Vector2d>> chord(const Outline& polygon, int axis,
                                                                 double at) {
  Outline met;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    if ((a[axis] < at) == (b[axis] < at)) continue;
    met.push_back(a + (b - a) * ((at - a[axis]) / (b[axis] - a[axis])));
  }
  if (met.size() != 2) return std::nullopt;
  return std::pair{met[0], met[1]};
}

/// Up to above a person's head; higher parts are no obstacle.

}  // namespace parhelion::semantic
