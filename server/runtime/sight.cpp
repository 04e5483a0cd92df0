#include "server/runtime/sight.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace parhelion::runtime {
namespace {

constexpr double kMinPixels = 3;  // diameter of what can be made out in a picture
constexpr double kWithin = 0.9;   // of a shape's half lengths: sample points lie inside it
constexpr double kBeyond = 1e-3;  // m

/// As the building hides it: virtual walls are drawn into the picture, too.
SemanticModel drawn(SemanticModel model) {
  for (ModelEntity& entity : model.entities) entity.is_virtual = false;
  return model;
}

/// Half the lengths of a box about the shape.
Eigen::Vector3d half_lengths(const Shape& shape) {
  const Eigen::Vector3d& size = shape.size;
  switch (shape.kind) {
    case ShapeKind::cylinder:
      return {size.x(), size.x(), size.z() / 2};
    case ShapeKind::sphere:
      return {size.x(), size.x(), size.x()};
    case ShapeKind::capsule:
      return {size.x(), size.x(), size.x() + size.z() / 2};
    case ShapeKind::box:
    case ShapeKind::mesh:
      break;
  }
  return size / 2;
}

/// The middle of the shape and a point towards each of its six sides, in the map.
std::array<Eigen::Vector3d, 7> points_of(const Shape& shape, const Transform<Map, Body>& T_map_body) {
  const auto T_map_shape = T_map_body * shape.T_body_shape;
  const Eigen::Vector3d half = kWithin * half_lengths(shape);
  std::array<Eigen::Vector3d, 7> points;
  points[0] = T_map_shape.translation();
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d offset = half[axis] * Eigen::Vector3d::Unit(axis);
    points[static_cast<std::size_t>(2 * axis + 1)] = T_map_shape * offset;
    points[static_cast<std::size_t>(2 * axis + 2)] = T_map_shape * Eigen::Vector3d(-offset);
  }
  return points;
}

double radius_of(const std::vector<Shape>& shapes) {
  double radius = 0;
  for (const Shape& shape : shapes)
    radius = std::max(radius, shape.T_body_shape.translation().norm() + bounding_radius(shape));
  return radius;
}

/// A pose at `from` whose x axis points at `to`.
Transform<Map, Laser> aimed(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return {Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), to - from), from};
}

bool in_image(const Eigen::Vector3d& p, const CameraIntrinsics& lens) {
  if (p.z() <= 0) return false;
  const double u = lens.fx * p.x() / p.z() + lens.cx, v = lens.fy * p.y() / p.z() + lens.cy;
  return u >= 0 && v >= 0 && u < lens.width && v < lens.height;
}

}  // namespace

Sight::Sight(const SemanticModel& model) { set_building(model); }

void Sight::set_building(const SemanticModel& model) {
  caster_.set_building(scan::BuildingTree(drawn(model), scan::BuildingTree::Doors::left_out));
}

void Sight::set_bodies(const WorldMessage& world, const simulation::EntityShapes& shapes) {
  const bool same =
      std::equal(bodies_.begin(), bodies_.end(), world.bodies.begin(), world.bodies.end(),
                 [](const Body& body, const WorldMessage::Entry& entry) {
                   return body.definition.entity == entry.entity && body.definition.part == entry.part;
                 });
  if (!same) {
    bodies_.clear();
    for (const WorldMessage::Entry& entry : world.bodies) {
      Body& body = bodies_.emplace_back();
      body.definition.entity = entry.entity;
      body.definition.part = entry.part;
    }
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    body.T_map_body = world.bodies[i].T_map_body;
    if (!body.definition.shapes.empty() && same) continue;
    const auto* known = shapes.find(body.definition.entity, body.definition.part);
    if (known == nullptr) continue;
    body.definition.shapes = *known;
    body.radius = radius_of(*known);
  }
}

void Sight::leave_out(const std::string& self) {
  motions_.clear();
  for (const Body& body : bodies_) {
    if (body.definition.entity != self)
      motions_.push_back({&body.definition, body.T_map_body, body.T_map_body});
  }
}

bool Sight::sees(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const std::string& entity) {
  constexpr std::array<float, 1> now{0};
  const auto T_map_ray = aimed(from, to);
  const scan::LaserMotion ray{T_map_ray, T_map_ray};
  const scan::BeamSet beam{0, 0, now};
  const double distance = (to - from).norm() + kBeyond;
  std::array<scan::RangeHit, 1> body{}, building{};
  caster_.cast_bodies(ray, beam, motions_, distance, body);
  if (body[0].body < 0 || motions_[static_cast<std::size_t>(body[0].body)].body->entity != entity)
    return false;
  caster_.cast_building(ray, beam, distance, building);
  return body[0].range <= building[0].range;
}

Sight::Entities Sight::in_camera(const Transform<Map, CameraOptical>& T_map_optical,
                                 const CameraIntrinsics& lens, const std::string& self) {
  leave_out(self);
  Entities seen;
  const Eigen::Isometry3d T_optical_map = T_map_optical.isometry().inverse(Eigen::Isometry);
  for (const Body& body : bodies_) {
    const std::string& entity = body.definition.entity;
    if (entity == self || seen.contains(entity)) continue;
    const Eigen::Vector3d origin = T_optical_map * body.T_map_body.translation();
    if (origin.z() < -body.radius || 2 * body.radius * lens.fx < kMinPixels * origin.z()) continue;
    for (const Shape& shape : body.definition.shapes) {
      const auto points = points_of(shape, body.T_map_body);
      const bool visible = std::any_of(points.begin(), points.end(), [&](const Eigen::Vector3d& p) {
        return in_image(T_optical_map * p, lens) && sees(T_map_optical.translation(), p, entity);
      });
      if (visible) seen.insert(entity);
      if (visible) break;
    }
  }
  return seen;
}

Sight::Entities Sight::in_laser(const Transform<Map, Laser>& T_map_laser, double max_range,
                                const std::string& self) {
  leave_out(self);
  Entities seen;
  const Eigen::Vector3d origin = T_map_laser.translation(), up = T_map_laser.rotation().col(2);
  for (const Body& body : bodies_) {
    const std::string& entity = body.definition.entity;
    const double away = (body.T_map_body.translation() - origin).norm();
    if (entity == self || seen.contains(entity) || away > max_range + body.radius) continue;
    for (const Shape& shape : body.definition.shapes) {
      const auto points = points_of(shape, body.T_map_body);
      const bool visible = std::any_of(points.begin(), points.end(), [&](const Eigen::Vector3d& p) {
        const Eigen::Vector3d level = p - (p - origin).dot(up) * up;
        return (level - origin).norm() < max_range && sees(origin, level, entity);
      });
      if (visible) seen.insert(entity);
      if (visible) break;
    }
  }
  return seen;
}

}  // namespace parhelion::runtime
