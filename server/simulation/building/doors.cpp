#include "server/simulation/building/doors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace parhelion::simulation {
namespace {

constexpr double kSpaceDepth = 0.3;             // m, of an opening without free space in the model
constexpr double kLeafDensity = 250;            // kg/m^3: two boards and a honeycomb
constexpr double kMinMass = 5, kMaxMass = 120;  // kg
constexpr double kHandleHeight = 1.05, kHandleInset = 0.06, kHandleGap = 0.04;  // m
constexpr double kPassable = 0.9;  // rad: from this angle a person can pass

Eigen::Vector2d closed_center(const Door& door) {
  return leaf_at(door.in_model, door.hinge, door.hinge.closed).translation().head<2>();
}

/// The free space with the door's name, else the nearest at its closed leaf, else its opening.
ModelEntity free_space_of(const Door& door, const std::vector<ModelEntity>& spaces) {
  const Eigen::Vector2d center = closed_center(door);
  const ModelEntity* nearest = nullptr;
  double smallest = door.in_model.size.x() / 2;
  for (const ModelEntity& space : spaces) {
    if (space.name == "free space of " + door.in_model.name) return space;
    const double distance = (space.T_map_body.translation().head<2>() - center).norm();
    if (distance < smallest) {
      smallest = distance;
      nearest = &space;
    }
  }
  if (nearest) return *nearest;
  ModelEntity opening = door.in_model;
  opening.T_map_body = leaf_at(door.in_model, door.hinge, door.hinge.closed);
  opening.size.y() = std::max(opening.size.y(), kSpaceDepth);
  return opening;
}

}  // namespace

Footprint projection(const Transform<Map, Body>& T_map_body, const Eigen::Vector3d& size, double& bottom,
                     double& top) {
  std::vector<Eigen::Vector2d> corners;
  bottom = std::numeric_limits<double>::infinity();
  top = -bottom;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
    const Eigen::Vector3d p = T_map_body * Eigen::Vector3d(sign.cwiseProduct(size));
    corners.emplace_back(p.x(), p.y());
    bottom = std::min(bottom, p.z());
    top = std::max(top, p.z());
  }
  return make_polygon(convex_hull(std::move(corners)));
}

Door make_door(const ModelEntity& entity, const std::vector<ModelEntity>& spaces, const DoorRules& rules) {
  Door door;
  door.in_model = entity;
  door.hinge = hinge_of(entity);
  for (const DoorSettings& settings : rules.settings) {
    if (settings.name == entity.name) door.settings = settings;
  }
  if (door.settings.is_virtual) door.in_model.is_virtual = *door.settings.is_virtual;
  const bool simulated = rules.level < 3 || door.in_model.is_virtual;
  door.dynamic = simulated && !door.settings.locked;
  door.outline = make_rectangle(entity.size.x(), entity.size.y());
  const ModelEntity space = free_space_of(door, spaces);
  door.space = projection(space.T_map_body, space.size, door.space_bottom, door.space_top);
  if (door.settings.angle) {
    const double angle = angle_of(door.hinge, *door.settings.angle);
    door.angle = std::clamp(angle, door.hinge.lower, door.hinge.upper);
  }
  if (!door.dynamic && (door.settings.angle || simulated)) door.commanded = door.angle;
  door.known = door.dynamic || door.commanded;
  door.open = door.is_turned_open();
  door.rigid.T_map_body = door.angle == 0 ? entity.T_map_body : leaf_at(entity, door.hinge, door.angle);
  return door;
}

bool Door::opens_when_pushed_from(const Eigen::Vector2d& p) const {
  if (!dynamic || unhinged) return false;
  if (std::abs(opening()) > kPassable) return true;
  const Transform<Map, Body> T_map_closed = leaf_at(in_model, hinge, hinge.closed);
  const double z = T_map_closed.translation().z();
  const double side = (T_map_closed.inverse() * Eigen::Vector3d(p.x(), p.y(), z)).y();
  // Pushed from its left, the leaf turns right if its hinge is behind.
  const bool turns_up = (side < 0) == (hinge.axis.x() < 0);
  return (turns_up ? hinge.upper - hinge.closed : hinge.closed - hinge.lower) > kPassable;
}

std::vector<Shape> leaf_shapes(const Door& door) {
  const Eigen::Vector3d& size = door.in_model.size;
  std::vector<Shape> shapes{{ShapeKind::box, size, {}, door.in_model.material}};
  if (!door.dynamic || size.x() < 0.4 || size.z() < kHandleHeight + 0.1) return shapes;
  // A lever on each side, near the edge opposite the hinge.
  const Material metal{{0.55F, 0.56F, 0.58F}, 0.3F, 1, 0.6F};
  const Eigen::Vector3d lever(0.12, 0.02, 0.02);
  const double x = (door.hinge.axis.x() > 0 ? -1 : 1) * (size.x() / 2 - kHandleInset - lever.x() / 2);
  const double z = kHandleHeight - size.z() / 2;
  for (const double side : {-1.0, 1.0}) {
    const Eigen::Vector3d at(x, side * (size.y() / 2 + kHandleGap), z);
    shapes.push_back(
        {ShapeKind::box, lever, Transform<Body, ShapeFrame>(Eigen::Quaterniond::Identity(), at), metal});
  }
  return shapes;
}

void hang_door(Physics& physics, Door& door) {
  const Eigen::Vector3d& size = door.in_model.size;
  if (!door.dynamic) {
    door.handle = physics.add_fixed_box(door.rigid.T_map_body, size, false);
    return;
  }
  const double mass = std::clamp(kLeafDensity * size.prod(), kMinMass, kMaxMass);
  door.anchor = physics.add_anchor(door.in_model.T_map_body);
  door.handle = physics.add_leaf(size, mass, door.rigid.T_map_body);
  JointDefinition hinge;
  hinge.a = door.anchor;
  hinge.b = door.handle;
  // A joint turns about its x axis, which is the leaf's z.
  hinge.T_a_joint.linear() << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  hinge.T_a_joint.translation() = Eigen::Vector3d(door.hinge.axis.x(), door.hinge.axis.y(), 0);
  hinge.T_b_joint = hinge.T_a_joint;
  hinge.limited = true;
  hinge.lower = door.hinge.lower;
  hinge.upper = door.hinge.upper;
  door.joint = physics.add_joint(hinge);
  physics.restart_joint(door.joint, door.angle);
}

void unhang_door(Physics& physics, const Door& door) {
  if (!door.dynamic) return;
  physics.remove_joint(door.joint);
  physics.remove(door.anchor);
}

}  // namespace parhelion::simulation
