#include "server/simulation/doors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocols/nearest_name.hpp"
#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kOpened = 10 * std::numbers::pi / 180;  // rad: turned so far, a door is open
constexpr double kSpaceDepth = 0.3;   // m, of an opening whose free space the model does not have
constexpr double kFollowSpeed = 3.0;  // rad/s: a real leaf follows what is said of it like a leaf that turns
constexpr double kAngleSlack = 0.01;  // rad
constexpr double kLeafDensity = 250;  // kg/m^3: two boards and a honeycomb
constexpr double kLeastMass = 5, kMostMass = 120;                               // kg
constexpr double kHandleHeight = 1.05, kHandleInset = 0.06, kHandleGap = 0.04;  // m
constexpr double kCloserSpeed = 0.8;  // rad/s that a closer's damper allows
constexpr double kPassable = 0.9;     // rad: open so far, it lets one through
constexpr double kShut = 0.002;       // rad
constexpr double kPullWindow = 0.02;  // s in which an impulse breaks a hinge

Eigen::Vector2d closed_center(const Door& door) {
  return leaf_at(door.drawn, door.hinge, door.hinge.closed).translation().head<2>();
}

/// The free space that bears the door's name, else the nearest that is about its closed leaf, else its
/// opening.
ModelEntity free_space_of(const Door& door, const std::vector<ModelEntity>& spaces) {
  const Eigen::Vector2d center = closed_center(door);
  const ModelEntity* nearest = nullptr;
  double least = door.drawn.size.x() / 2;
  for (const ModelEntity& space : spaces) {
    if (space.name == "free space of " + door.drawn.name) return space;
    const double distance = (space.T_map_body.translation().head<2>() - center).norm();
    if (distance < least) {
      least = distance;
      nearest = &space;
    }
  }
  if (nearest) return *nearest;
  ModelEntity opening = door.drawn;
  opening.T_map_body = leaf_at(door.drawn, door.hinge, door.hinge.closed);
  opening.size.y() = std::max(opening.size.y(), kSpaceDepth);
  return opening;
}

bool same_make(const Door& a, const Door& b) {
  return a.drawn.name == b.drawn.name && a.dynamic == b.dynamic &&
         a.drawn.T_map_body.isometry().isApprox(b.drawn.T_map_body.isometry(), 0) &&
         a.drawn.size == b.drawn.size && a.hinge.axis == b.hinge.axis && a.hinge.lower == b.hinge.lower &&
         a.hinge.upper == b.hinge.upper && a.hinge.closed == b.hinge.closed;
}

std::string degrees(double angle) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f deg", angle * 180 / std::numbers::pi);
  return text;
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
  door.drawn = entity;
  door.hinge = hinge_of(entity);
  for (const DoorSettings& settings : rules.settings) {
    if (settings.name == entity.name) door.settings = settings;
  }
  if (door.settings.is_virtual) door.drawn.is_virtual = *door.settings.is_virtual;
  const bool simulated = rules.level < 3 || door.drawn.is_virtual;
  door.dynamic = simulated && !door.settings.locked;
  door.outline = make_rectangle(entity.size.x(), entity.size.y());
  const ModelEntity space = free_space_of(door, spaces);
  door.space = projection(space.T_map_body, space.size, door.space_bottom, door.space_top);
  if (door.settings.angle) {
    const double said = angle_of(door.hinge, *door.settings.angle);
    door.angle = std::clamp(said, door.hinge.lower, door.hinge.upper);
  }
  if (!door.dynamic && (door.settings.angle || simulated)) door.said = door.angle;
  door.known = door.dynamic || door.said;
  door.open = std::abs(door.opening()) > kOpened;
  door.rigid.T_map_body = door.angle == 0 ? entity.T_map_body : leaf_at(entity, door.hinge, door.angle);
  return door;
}

bool Door::gives_way_to(const Eigen::Vector2d& p) const {
  if (!dynamic || unhinged) return false;
  if (std::abs(opening()) > kPassable) return true;
  const Transform<Map, Body> T_map_closed = leaf_at(drawn, hinge, hinge.closed);
  const double z = T_map_closed.translation().z();
  const double side = (T_map_closed.inverse() * Eigen::Vector3d(p.x(), p.y(), z)).y();
  // Pushed from its left, the leaf turns to the right of a hinge that is behind it.
  const bool turns_up = (side < 0) == (hinge.axis.x() < 0);
  return (turns_up ? hinge.upper - hinge.closed : hinge.closed - hinge.lower) > kPassable;
}

std::vector<Shape> leaf_shapes(const Door& door) {
  const Eigen::Vector3d& size = door.drawn.size;
  std::vector<Shape> shapes{{ShapeKind::box, size, {}, door.drawn.material}};
  if (!door.dynamic || size.x() < 0.4 || size.z() < kHandleHeight + 0.1) return shapes;
  // A lever on each side, beside the edge that is away from the hinge.
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
  const Eigen::Vector3d& size = door.drawn.size;
  if (!door.dynamic) {
    door.handle = physics.add_fixed_box(door.rigid.T_map_body, size, false);
    return;
  }
  const double mass = std::clamp(kLeafDensity * size.prod(), kLeastMass, kMostMass);
  door.anchor = physics.add_anchor(door.drawn.T_map_body);
  door.handle = physics.add_leaf(size, mass, door.rigid.T_map_body);
  JointDefinition hinge;
  hinge.a = door.anchor;
  hinge.b = door.handle;
  // A joint turns about its x axis: that is the leaf's z.
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

Door* Simulation::State::find_door(const std::string& name) {
  const auto at =
      std::find_if(doors.begin(), doors.end(), [&](const Door& door) { return door.drawn.name == name; });
  return at == doors.end() ? nullptr : &*at;
}

void Simulation::State::put_leaf(Door& door, double angle) {
  wake_all();
  door.angle = angle;
  door.rigid = {leaf_at(door.drawn, door.hinge, angle), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  door.open = std::abs(door.opening()) > kOpened;
  door.turning = false;
  door.moved = true;
  ++door.epoch;
  if (door.dynamic) {
    physics.teleport(door.handle, door.rigid.T_map_body);
    physics.restart_joint(door.joint, angle);
  } else {
    physics.move_fixed(door.handle, door.rigid.T_map_body, door.rigid.velocity, door.rigid.rotation_rate);
  }
  building->move_leaf(door);
}

bool Simulation::State::walks_through(const Agent& agent, const FixedObstacle& leaf) const {
  if (!leaf.gives_way || !agent.definition.behaviour.opens_doors) return false;
  const auto door = std::find_if(doors.begin(), doors.end(), [&](const Door& each) {
    return &building->obstacles()[each.obstacle] == &leaf;
  });
  return door != doors.end() && door->gives_way_to(agent.pose.position());
}

/// Friction of the hinge, and a closer that pulls with its torque as fast as its damper allows: less by the
/// friction while the leaf closes, more while somebody opens it.
void Simulation::State::work_hinge(Door& door) {
  const double left = door.hinge.closed - door.angle;
  const double closer = door.settings.closer, friction = door.settings.friction;
  const bool pulls = closer > friction && std::abs(left) > kShut;
  physics.keep_awake(door.handle, pulls);
  if (!pulls) {
    physics.drive_joint(door.joint, 0, friction);
    return;
  }
  const double turning = door.rigid.rotation_rate.dot(door.rigid.T_map_body.rotation().col(2));
  const bool opened = turning * left < 0;
  const double speed = std::copysign(std::min(kCloserSpeed, std::abs(left) / (4 * dt)), left);
  physics.drive_joint(door.joint, speed, opened ? closer + friction : closer - friction);
}

void Simulation::State::unhinge(Door& door, double impulse) {
  physics.release_joint(door.joint, true);
  physics.drop_leaf(door.handle);
  physics.keep_awake(door.handle, false);
  door.unhinged = door.moved = true;
  say_door(EventKind::door_unhinged, door, 0);
  events.back().impulse = impulse;
}

void Simulation::State::move_doors() {
  for (Door& door : doors) {
    if (door.dynamic) {
      if (!door.unhinged) work_hinge(door);
      continue;
    }
    const std::optional<double> target = door.said ? door.said : door.seen;
    if (!target) {
      if (!door.known) continue;
      door.known = false;
      door.moved = true;
      building->move_leaf(door);
    } else if (!door.known) {
      door.known = true;
      const bool was_open = door.open, was_known = door.moved;
      put_leaf(door, *target);
      // What turned it while nobody saw it is said now.
      if (was_known) door.open = was_open;
      continue;
    }
    const double left = target ? *target - door.angle : 0;
    if (left == 0 && !door.turning) continue;
    const double most = kFollowSpeed * dt;
    const double turn = std::clamp(left, -most, most);
    door.angle = std::abs(left) <= most && target ? *target : door.angle + turn;
    door.turning = turn != 0;
    door.moved = true;
    const Eigen::Vector3d axis(door.hinge.axis.x(), door.hinge.axis.y(), 0);
    RigidState& rigid = door.rigid;
    rigid.T_map_body = leaf_at(door.drawn, door.hinge, door.angle);
    rigid.rotation_rate = rigid.T_map_body.rotation().col(2) * (turn / dt);
    rigid.velocity = rigid.rotation_rate.cross(-(rigid.T_map_body.rotation() * axis));
    physics.move_fixed(door.handle, rigid.T_map_body, rigid.velocity, rigid.rotation_rate);
    building->move_leaf(door);
  }
}

void Simulation::State::read_doors() {
  const auto window = static_cast<std::size_t>(std::max(1L, std::lround(kPullWindow / dt)));
  for (Door& door : doors) {
    if (!door.dynamic) continue;
    const RigidState rigid = physics.state(door.handle);
    const bool still = rigid.T_map_body.isometry().isApprox(door.rigid.T_map_body.isometry(), 0);
    door.rigid = rigid;
    if (!still) {
      door.moved = true;
      building->move_leaf(door);
    }
    if (door.unhinged) continue;
    const JointState hinge = physics.joint_state(door.joint);
    door.angle = hinge.position;
    door.impulses.resize(window);
    door.impulses[door.next_impulse] = hinge.pull * dt;
    door.next_impulse = (door.next_impulse + 1) % window;
  }
}

void Simulation::State::keep_doors(const std::vector<Door>& old) {
  for (Door& door : doors) {
    const auto before =
        std::find_if(old.begin(), old.end(), [&](const Door& each) { return same_make(each, door); });
    if (before == old.end()) continue;
    door.said = before->said;
    door.seen = before->seen;
    door.known = before->known;
    door.toucher = before->toucher;
    door.inside = before->inside;
    if (before->unhinged) {
      physics.release_joint(door.joint, true);
      physics.drop_leaf(door.handle);
      physics.teleport(door.handle, before->rigid.T_map_body);
      door.rigid.T_map_body = before->rigid.T_map_body;
      door.unhinged = door.moved = true;
      building->move_leaf(door);
    } else if (before->moved) {
      put_leaf(door, before->angle);
    }
  }
}

void Simulation::State::record_doors(std::vector<BodyState>& bodies) const {
  for (const Door& door : doors) {
    if (!door.moved) continue;
    bodies.push_back({door.id, door.epoch, door.rigid.T_map_body, door.rigid.velocity,
                      door.rigid.rotation_rate, door.known});
  }
}

Status Simulation::State::unknown_door(const std::string& name) const {
  std::vector<std::string> names;
  for (const Door& door : doors) names.push_back(door.drawn.name);
  if (names.empty()) return Error{"no door '" + name + "': the model has none"};
  return Error{"no door '" + name + "'" + suggestion_or_known(name, names)};
}

Status Simulation::State::set_door(const DoorCommand& command) {
  Door* door = find_door(command.door);
  if (!door) return unknown_door(command.door);
  if (!command.opening) {
    door->said.reset();
    return {};
  }
  const double opening = *command.opening;
  const double angle = angle_of(door->hinge, opening);
  if (!(angle >= door->hinge.lower - kAngleSlack && angle <= door->hinge.upper + kAngleSlack)) {
    const double one = opening_of(door->hinge, door->hinge.lower);
    const double other = opening_of(door->hinge, door->hinge.upper);
    return Error{"door '" + door->drawn.name + "' cannot be open by " + degrees(opening) + "; expected " +
                 degrees(std::min(one, other)) + " to " + degrees(std::max(one, other))};
  }
  const double within = std::clamp(angle, door->hinge.lower, door->hinge.upper);
  if (door->unhinged) return Error{"door '" + door->drawn.name + "' is off its hinge: it cannot be turned"};
  if (door->dynamic) {
    put_leaf(*door, within);
  } else {
    door->said = within;
  }
  return {};
}

std::vector<DoorState> Simulation::doors() const {
  std::vector<DoorState> states;
  for (const Door& door : state_->doors) {
    states.push_back(
        {door.drawn.name, door.opening(), door.known, door.dynamic, door.unhinged, door.rigid.T_map_body});
  }
  return states;
}

void Simulation::observe_door(const std::string& name, std::optional<double> opening) {
  Door* door = state_->find_door(name);
  if (!door || door->dynamic) return;
  if (!opening || !std::isfinite(*opening)) {
    door->seen.reset();
    return;
  }
  door->seen = std::clamp(angle_of(door->hinge, *opening), door->hinge.lower, door->hinge.upper);
}

const std::vector<Relation>& Simulation::relations_of(const std::string& entity) const {
  return state_->building->net().relations(entity);
}

}  // namespace parhelion::simulation
