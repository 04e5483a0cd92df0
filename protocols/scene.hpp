// The bodies of the world: rigid sets of simple shapes with materials. Constant; poses are in WorldSnapshot.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/shape_mesh.hpp"

namespace parhelion {

struct Material {
  Eigen::Vector3f albedo{0.5F, 0.5F, 0.5F};  ///< linear RGB, 0..1
  float roughness = 0.6F;                    ///< 0 mirror .. 1 matt
  float metallic = 0;
  float laser_reflectivity = 0.5F;  ///< 0..1, for scans that carry intensities
};

enum class ShapeKind : std::uint8_t {
  box,       ///< size: full lengths along x, y, z
  cylinder,  ///< size: radius, radius, full height along z
  sphere,    ///< size: radius in each
  capsule,   ///< size: radius, radius, height of the cylindrical part along z
  mesh,      ///< size: full lengths of its bounding box, whose middle is the shape's origin
};

struct Shape {
  ShapeKind kind = ShapeKind::box;
  Eigen::Vector3d size = Eigen::Vector3d::Ones();  ///< m, see ShapeKind
  Transform<Body, ShapeFrame> T_body_shape;
  Material material;
  std::shared_ptr<const ShapeMesh> mesh = nullptr;  ///< of kind mesh only, and never null there
};

/// Radius of a sphere about the shape's centre that holds it, m.
inline double bounding_radius(ShapeKind kind, const Eigen::Vector3d& size) {
  switch (kind) {
    case ShapeKind::box:
    case ShapeKind::mesh:
      return size.norm() / 2;
    case ShapeKind::cylinder:
      return std::hypot(size.x(), size.z() / 2);
    case ShapeKind::sphere:
      return size.x();
    case ShapeKind::capsule:
      return size.x() + size.z() / 2;
  }
  return 0;
}
inline double bounding_radius(const Shape& shape) { return bounding_radius(shape.kind, shape.size); }

enum class BodyOwner : std::uint8_t {
  agent,
  real_robot,
  building,
  real_person,  ///< whom sensors follow: never injected
};
inline constexpr BodyOwner kLastBodyOwner = BodyOwner::real_person;

using BodyId = std::uint32_t;  ///< unique in a session, not reused after a removal

/// One rigid body. An agent is one body or several (a person: torso and legs; a robot: chassis and wheels).
struct BodyDefinition {
  BodyId id = 0;
  std::string entity;  ///< name of the agent, robot or building element that it belongs to
  std::string part;    ///< "chassis", "left_leg", ...
  BodyOwner owner = BodyOwner::agent;
  bool injectable =
      false;  ///< may appear in real scans and images: agents and virtual walls only (promise 1)
  std::vector<Shape> shapes;
  bool moves = false;  ///< of the building: a door, whose pose may differ from the model's
};

/// Shared and immutable: adding or removing a body makes a new one with a larger `version`.
struct Scene {
  std::uint64_t version = 0;
  std::vector<std::shared_ptr<const BodyDefinition>> bodies;  ///< ascending id
};

}  // namespace parhelion
