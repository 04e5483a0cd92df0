// Exact reference implementations, as simple as possible and without geometry code of the fast path. Surfaces
// are intersected one by one: each face of a box, the side and the caps of a cylinder, the pieces of a
// capsule.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "fusion/scan/building_tree.hpp"
#include "fusion/scan/ray_caster.hpp"

namespace parhelion::scan {
namespace {

using Eigen::Vector3d;

constexpr double kNone = std::numeric_limits<double>::infinity();

/// In the frame of one shape; the direction has unit length.
struct Ray {
  Vector3d origin, direction;
  Vector3d at(double t) const { return origin + t * direction; }
};

void keep_nearer(double t, bool on_surface, double& nearest) {
  if (on_surface && t >= 0 && t < nearest) nearest = t;
}

double box(const Ray& ray, const Vector3d& size) {
  const Vector3d half = size / 2;
  if ((ray.origin.cwiseAbs().array() <= half.array()).all()) return 0;
  double nearest = kNone;
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.direction[axis] == 0) continue;
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const double face : {-half[axis], half[axis]}) {
      const double t = (face - ray.origin[axis]) / ray.direction[axis];
      const Vector3d p = ray.at(t);
      keep_nearer(t, std::abs(p[u]) <= half[u] && std::abs(p[v]) <= half[v], nearest);
    }
  }
  return nearest;
}

/// Intersection of the ray with the triangle's plane, if it is on the inner side of all three edges.
double triangle(const Ray& ray, const std::vector<Eigen::Vector3f>& vertices,
                const std::array<std::uint32_t, 3>& corners) {
  std::array<Vector3d, 3> p;
  for (std::size_t i = 0; i < 3; ++i) p[i] = vertices[corners[i]].cast<double>();
  const Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
  const double slope = normal.dot(ray.direction);
  if (slope == 0) return kNone;
  const double t = normal.dot(p[0] - ray.origin) / slope;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d edge = p[(i + 1) % 3] - p[i];
    if (normal.dot(edge.cross(ray.at(t) - p[i])) < -1e-9 * normal.squaredNorm()) return kNone;
  }
  return t >= 0 ? t : kNone;
}

double sphere(const Ray& ray, const Vector3d& center, double radius) {
  const Vector3d to_center = center - ray.origin;
  if (to_center.norm() <= radius) return 0;
  const double along = to_center.dot(ray.direction);
  const double miss = (to_center - along * ray.direction).norm();
  if (miss > radius) return kNone;
  const double t = along - std::sqrt((radius - miss) * (radius + miss));
  return t >= 0 ? t : kNone;
}

/// The round side of a cylinder about z: both intersections between its ends.
double side(const Ray& ray, double radius, double half_height) {
  const double a = ray.direction.head<2>().squaredNorm();
  if (a == 0) return kNone;
  const double nearest_to_axis = -ray.origin.head<2>().dot(ray.direction.head<2>()) / a;
  const double miss = ray.at(nearest_to_axis).head<2>().norm();
  if (miss > radius) return kNone;
  const double half_chord = std::sqrt((radius - miss) * (radius + miss) / a);
  double nearest = kNone;
  for (const double t : {nearest_to_axis - half_chord, nearest_to_axis + half_chord}) {
    keep_nearer(t, std::abs(ray.at(t).z()) <= half_height, nearest);
  }
  return nearest;
}

double cylinder(const Ray& ray, double radius, double height) {
  const double half = height / 2;
  if (std::abs(ray.origin.z()) <= half && ray.origin.head<2>().norm() <= radius) return 0;
  double nearest = side(ray, radius, half);
  if (ray.direction.z() == 0) return nearest;
  for (const double cap : {-half, half}) {
    const double t = (cap - ray.origin.z()) / ray.direction.z();
    keep_nearer(t, ray.at(t).head<2>().norm() <= radius, nearest);
  }
  return nearest;
}

double capsule(const Ray& ray, double radius, double height) {
  const double half = height / 2;
  if (std::abs(ray.origin.z()) <= half && ray.origin.head<2>().norm() <= radius) return 0;
  return std::min(
      {side(ray, radius, half), sphere(ray, {0, 0, -half}, radius), sphere(ray, {0, 0, half}, radius)});
}

double mesh(const Ray& ray, const ShapeMesh& mesh) {
  double nearest = kNone;
  for (const MeshTriangle& corners : mesh.triangles)
    nearest = std::min(nearest, triangle(ray, mesh.vertices, corners));
  return nearest;
}

double shape_range(const Ray& ray, const Shape& shape) {
  const Vector3d& size = shape.size;
  switch (shape.kind) {
    case ShapeKind::box:
      return box(ray, size);
    case ShapeKind::cylinder:
      return cylinder(ray, size.x(), size.z());
    case ShapeKind::sphere:
      return sphere(ray, Vector3d::Zero(), size.x());
    case ShapeKind::capsule:
      return capsule(ray, size.x(), size.z());
    case ShapeKind::mesh:
      return mesh(ray, *shape.mesh);
  }
  return kNone;
}

template <class Frame>
Ray seen_from(const Transform<Map, Frame>& T_map_shape, const Ray& ray_map) {
  return {T_map_shape.inverse() * ray_map.origin, T_map_shape.rotation().transpose() * ray_map.direction};
}

Ray beam_ray(const LaserMotion& laser, const BeamSet& beams, std::size_t i) {
  const auto T_map_laser = interpolate(laser.T_map_laser_start, laser.T_map_laser_end, double{beams.time[i]});
  const double angle = beams.angle(i);
  return {T_map_laser.translation(), T_map_laser.rotation() * Vector3d(std::cos(angle), std::sin(angle), 0)};
}

struct Nearest {
  double range = kNone;
  std::int32_t body = -1;
  float reflectivity = 0;

  void offer(double t, std::int32_t index, float r) {
    if (t < range) *this = {t, index, r};
  }
  RangeHit within(double max_range) const {
    if (!(range <= max_range)) return {std::numeric_limits<float>::infinity(), -1, 0};
    return {static_cast<float>(range), body, reflectivity};
  }
};

}  // namespace

void cast_bodies_exact(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> bodies,
                       double max_range, std::span<RangeHit> hits) {
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Ray ray = beam_ray(laser, beams, i);
    Nearest nearest;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const auto T_map_body =
          interpolate(bodies[b].T_map_body_start, bodies[b].T_map_body_end, double{beams.time[i]});
      for (const Shape& shape : bodies[b].body->shapes) {
        const double t = shape_range(seen_from(T_map_body * shape.T_body_shape, ray), shape);
        nearest.offer(t, static_cast<std::int32_t>(b), shape.material.laser_reflectivity);
      }
    }
    hits[i] = nearest.within(max_range);
  }
}

void cast_building_exact(const LaserMotion& laser, const BeamSet& beams, const SemanticModel& model,
                         double max_range, std::span<RangeHit> hits) {
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Ray ray = beam_ray(laser, beams, i);
    Nearest nearest;
    for (const ModelEntity& entity : model.entities) {
      if (entity.is_virtual || !is_solid(entity)) continue;
      nearest.offer(box(seen_from(entity.T_map_body, ray), entity.size), -1,
                    entity.material.laser_reflectivity);
    }
    for (const ModelMesh& mesh : model.meshes) {
      for (const auto& corners : mesh.triangles)
        nearest.offer(triangle(ray, mesh.vertices, corners), -1, kMeshReflectivity);
    }
    hits[i] = nearest.within(max_range);
  }
}

void cast_building_exact(const LaserMotion& laser, const BeamSet& beams, const SemanticModel& model,
                         std::span<const BodyMotion> doors, double max_range, std::span<RangeHit> hits) {
  SemanticModel walls = model;
  std::erase_if(walls.entities, [](const ModelEntity& e) { return e.label == EntityLabel::door; });
  std::vector<RangeHit> leaf(hits.size());
  cast_building_exact(laser, beams, walls, max_range, hits);
  cast_bodies_exact(laser, beams, doors, max_range, leaf);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (leaf[i].range < hits[i].range) hits[i] = {leaf[i].range, -1, leaf[i].reflectivity};
  }
}

}  // namespace parhelion::scan
