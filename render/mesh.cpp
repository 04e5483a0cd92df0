#include "render/mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace parhelion::render {
namespace {

using Index = std::uint16_t;

Index add(Mesh& mesh, const Eigen::Vector3f& core, const Eigen::Vector3f& direction) {
  mesh.vertices.push_back({{core.x(), core.y(), core.z()}, {direction.x(), direction.y(), direction.z()}});
  return static_cast<Index>(mesh.vertices.size() - 1);
}

/// Adds the triangle with the winding that faces away from the origin (every shape is convex and contains
/// it).
void triangle(Mesh& mesh, Index a, Index b, Index c) {
  const auto point = [&](Index i) {
    const MeshVertex& v = mesh.vertices[i];
    return Eigen::Vector3f(v.core[0] + 0.1F * v.direction[0], v.core[1] + 0.1F * v.direction[1],
                           v.core[2] + 0.1F * v.direction[2]);
  };
  const Eigen::Vector3f p = point(a), q = point(b), r = point(c);
  if ((q - p).cross(r - p).dot(p + q + r) < 0) std::swap(b, c);
  mesh.indices.insert(mesh.indices.end(), {a, b, c});
}

void quad(Mesh& mesh, Index a, Index b, Index c, Index d) {
  triangle(mesh, a, b, c);
  triangle(mesh, a, c, d);
}

Mesh make_box(bool bevelled) {
  Mesh mesh;
  // Vertex of corner (sign bits) on the face along an axis.
  std::array<std::array<Index, 3>, 8> at{};
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3f core((corner & 1) ? 1.F : -1.F, (corner & 2) ? 1.F : -1.F,
                               (corner & 4) ? 1.F : -1.F);
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3f direction = Eigen::Vector3f::Zero();
      direction[axis] = core[axis];
      at[static_cast<std::size_t>(corner)][static_cast<std::size_t>(axis)] = add(mesh, core, direction);
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t b = std::size_t{1} << ((axis + 1) % 3), c = std::size_t{1} << ((axis + 2) % 3);
    for (const std::size_t s : {std::size_t{0}, std::size_t{1} << axis})
      quad(mesh, at[s][axis], at[s | b][axis], at[s | b | c][axis], at[s | c][axis]);
    if (!bevelled) continue;
    // The four edges along this axis, each between its two other faces.
    const std::size_t along = std::size_t{1} << axis;
    for (const std::size_t s : {std::size_t{0}, b, c, b | c})
      quad(mesh, at[s][(axis + 1) % 3], at[s | along][(axis + 1) % 3], at[s | along][(axis + 2) % 3],
           at[s][(axis + 2) % 3]);
  }
  if (bevelled)
    for (const auto& corner : at) triangle(mesh, corner[0], corner[1], corner[2]);
  return mesh;
}

Mesh make_cylinder(int segments, bool bevelled) {
  Mesh mesh;
  const auto n = static_cast<std::size_t>(segments);
  for (std::size_t i = 0; i < n; ++i) {
    const auto angle = static_cast<float>(2 * std::numbers::pi * static_cast<double>(i) / segments);
    const float c = std::cos(angle), s = std::sin(angle);
    for (const float z : {-1.F, 1.F}) {
      add(mesh, {c, s, z}, {c, s, 0});
      add(mesh, {c, s, z}, {0, 0, z});
    }
  }
  const auto side = [&](std::size_t i, std::size_t top) { return static_cast<Index>(4 * (i % n) + 2 * top); };
  const auto cap = [&](std::size_t i, std::size_t top) { return static_cast<Index>(side(i, top) + 1); };
  for (std::size_t i = 0; i < n; ++i) {
    quad(mesh, side(i, 0), side(i + 1, 0), side(i + 1, 1), side(i, 1));
    for (const std::size_t top : {std::size_t{0}, std::size_t{1}}) {
      if (bevelled) quad(mesh, side(i, top), side(i + 1, top), cap(i + 1, top), cap(i, top));
      if (i >= 1 && i + 1 < n) triangle(mesh, cap(0, top), cap(i, top), cap(i + 1, top));
    }
  }
  return mesh;
}

/// A sphere whose two halves may be apart: a capsule (apart = 1) or a sphere (0).
Mesh make_round(int segments, float apart) {
  Mesh mesh;
  const auto n = static_cast<std::size_t>(segments);
  const std::size_t rings = n / 4;  // from the equator to the pole, each half
  const auto add_ring = [&](double elevation, float z) {
    const auto first = static_cast<Index>(mesh.vertices.size());
    for (std::size_t i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / segments;
      add(mesh, {0, 0, z},
          Eigen::Vector3d(std::cos(elevation) * std::cos(angle), std::cos(elevation) * std::sin(angle),
                          std::sin(elevation))
              .cast<float>());
    }
    return first;
  };
  const auto join = [&](Index lower, Index upper) {
    for (std::size_t i = 0; i < n; ++i) {
      const auto j = static_cast<Index>((i + 1) % n), k = static_cast<Index>(i);
      quad(mesh, static_cast<Index>(lower + k), static_cast<Index>(lower + j), static_cast<Index>(upper + j),
           static_cast<Index>(upper + k));
    }
  };
  Index equators[2] = {0, 0};
  for (const int half : {0, 1}) {
    const float sign = half ? 1.F : -1.F;
    Index ring = equators[half] = half && apart == 0 ? equators[0] : add_ring(0, sign * apart);
    for (std::size_t r = 1; r < rings; ++r) {
      const double elevation =
          sign * 0.5 * std::numbers::pi * static_cast<double>(r) / static_cast<double>(rings);
      const Index next = add_ring(elevation, sign * apart);
      join(ring, next);
      ring = next;
    }
    const Index pole = add(mesh, {0, 0, sign * apart}, {0, 0, sign});
    for (std::size_t i = 0; i < n; ++i)
      triangle(mesh, static_cast<Index>(ring + i), static_cast<Index>(ring + (i + 1) % n), pole);
  }
  if (apart > 0) join(equators[0], equators[1]);
  return mesh;
}

}  // namespace

double edge_bevel(const Shape& shape) {
  const Eigen::Vector3d half = half_extents(shape).cast<double>();
  return std::min(0.006, 0.15 * half.minCoeff());
}

Eigen::Vector3d half_extents(const Shape& shape) {
  const Eigen::Vector3d& s = shape.size;
  switch (shape.kind) {
    case ShapeKind::box:
    case ShapeKind::mesh:
      return 0.5 * s;
    case ShapeKind::cylinder:
      return {s.x(), s.x(), 0.5 * s.z()};
    case ShapeKind::sphere:
      return {s.x(), s.x(), s.x()};
    case ShapeKind::capsule:
      return {s.x(), s.x(), 0.5 * s.z() + s.x()};
  }
  return 0.5 * s;
}

ShapeScale shape_scale(const Shape& shape, bool bevelled) {
  const Eigen::Vector3d half = half_extents(shape);
  switch (shape.kind) {
    case ShapeKind::sphere:
      return {Eigen::Vector3f::Zero(), static_cast<float>(half.x())};
    case ShapeKind::capsule:
      return {Eigen::Vector3f(0, 0, static_cast<float>(0.5 * shape.size.z())), static_cast<float>(half.x())};
    default:
      break;
  }
  const double bevel = bevelled ? edge_bevel(shape) : 0;
  return {(half.array() - bevel).matrix().cast<float>(), static_cast<float>(bevel)};
}

Mesh make_mesh(ShapeKind kind, int segments, bool bevelled) {
  switch (kind) {
    case ShapeKind::box:
    case ShapeKind::mesh:  // for its bounding box
      return make_box(bevelled);
    case ShapeKind::cylinder:
      return make_cylinder(segments, bevelled);
    case ShapeKind::sphere:
      return make_round(segments, 0);
    case ShapeKind::capsule:
      return make_round(segments, 1);
  }
  return {};
}

}  // namespace parhelion::render
