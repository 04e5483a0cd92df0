#include "server/simulation/world/door_set.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocols/nearest_name.hpp"
#include "server/simulation/building/building.hpp"
#include "server/simulation/world/unconstrained_motion.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kFollowSpeed = 3.0;  // rad/s, maximum speed of a real leaf towards its measured angle
constexpr double kAngleSlack = 0.01;  // rad
constexpr double kCloserSpeed = 0.8;  // rad/s, limit of a closer's damper
constexpr double kShut = 0.002;       // rad
constexpr double kPullWindow = 0.02;  // s over which the impulse on a hinge is summed for breaking

bool same_make(const Door& a, const Door& b) {
  return a.in_model.name == b.in_model.name && a.dynamic == b.dynamic &&
         a.in_model.T_map_body.isometry().isApprox(b.in_model.T_map_body.isometry(), 0) &&
         a.in_model.size == b.in_model.size && a.hinge.axis == b.hinge.axis &&
         a.hinge.lower == b.hinge.lower && a.hinge.upper == b.hinge.upper && a.hinge.closed == b.hinge.closed;
}

std::string degrees(double angle) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f deg", angle * 180 / std::numbers::pi);
  return text;
}

/// Sets a leaf's angle immediately.
void put_leaf(Door& door, double angle, Building& building, Agents& agents, Physics& physics) {
  constrain_all(agents, physics);
  door.angle = angle;
  door.rigid = {leaf_at(door.in_model, door.hinge, angle), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  door.open = door.is_turned_open();
  door.turning = false;
  door.moved = true;
  ++door.epoch;
  if (door.dynamic) {
    physics.teleport(door.handle, door.rigid.T_map_body);
    physics.restart_joint(door.joint, angle);
  } else {
    physics.move_fixed(door.handle, door.rigid.T_map_body, door.rigid.velocity, door.rigid.rotation_rate);
  }
  building.move_leaf(door);
}

/// Friction of the hinge, and a closer with its torque up to its damper's speed: reduced by the friction
/// while closing, increased while being opened.
void drive_hinge(const Door& door, Physics& physics, double dt) {
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

/// Turns a real leaf towards `target` (rad of the hinge; none: it stops) at limited speed.
void turn_leaf(Door& door, const std::optional<double>& target, Building& building, Physics& physics,
               double dt) {
  const double left = target ? *target - door.angle : 0;
  if (left == 0 && !door.turning) return;
  const double max_turn = kFollowSpeed * dt;
  const double turn = std::clamp(left, -max_turn, max_turn);
  door.angle = std::abs(left) <= max_turn && target ? *target : door.angle + turn;
  door.turning = turn != 0;
  door.moved = true;
  const Eigen::Vector3d axis(door.hinge.axis.x(), door.hinge.axis.y(), 0);
  RigidState& rigid = door.rigid;
  rigid.T_map_body = leaf_at(door.in_model, door.hinge, door.angle);
  rigid.rotation_rate = rigid.T_map_body.rotation().col(2) * (turn / dt);
  rigid.velocity = rigid.rotation_rate.cross(-(rigid.T_map_body.rotation() * axis));
  physics.move_fixed(door.handle, rigid.T_map_body, rigid.velocity, rigid.rotation_rate);
  building.move_leaf(door);
}

void move_real_door(Door& door, Building& building, Agents& agents, Physics& physics, double dt) {
  const std::optional<double> target = door.commanded ? door.commanded : door.seen;
  if (!target) {
    if (!door.known) return;
    door.known = false;
    door.moved = true;
    building.move_leaf(door);
  } else if (!door.known) {
    door.known = true;
    const bool was_open = door.open, was_known = door.moved;
    put_leaf(door, *target, building, agents, physics);
    // Changes while the angle was unknown are reported now.
    if (was_known) door.open = was_open;
    return;
  }
  turn_leaf(door, target, building, physics, dt);
}

}  // namespace

Door* DoorSet::find(const std::string& name) {
  const auto at = std::find_if(doors_.begin(), doors_.end(),
                               [&](const Door& door) { return door.in_model.name == name; });
  return at == doors_.end() ? nullptr : &*at;
}

bool DoorSet::opens_when_pushed(const Building& building, const FixedObstacle& leaf,
                                const Eigen::Vector2d& p) const {
  const auto door = std::find_if(doors_.begin(), doors_.end(), [&](const Door& each) {
    return &building.obstacles()[each.obstacle] == &leaf;
  });
  return door != doors_.end() && door->opens_when_pushed_from(p);
}

Status DoorSet::unknown(const std::string& name) const {
  std::vector<std::string> names;
  for (const Door& door : doors_) names.push_back(door.in_model.name);
  if (names.empty()) return Error{"no door '" + name + "': the model has none"};
  return Error{"no door '" + name + "'" + suggestion_or_known(name, names)};
}

Status DoorSet::command(const DoorCommand& command, Building& building, Agents& agents, Physics& physics) {
  Door* door = find(command.door);
  if (!door) return unknown(command.door);
  if (!command.opening) {
    door->commanded.reset();
    return {};
  }
  const double opening = *command.opening;
  const double angle = angle_of(door->hinge, opening);
  if (!(angle >= door->hinge.lower - kAngleSlack && angle <= door->hinge.upper + kAngleSlack)) {
    const double one = opening_of(door->hinge, door->hinge.lower);
    const double other = opening_of(door->hinge, door->hinge.upper);
    return Error{"door '" + door->in_model.name + "' cannot be open by " + degrees(opening) + "; expected " +
                 degrees(std::min(one, other)) + " to " + degrees(std::max(one, other))};
  }
  const double within = std::clamp(angle, door->hinge.lower, door->hinge.upper);
  if (door->unhinged)
    return Error{"door '" + door->in_model.name + "' is off its hinge: it cannot be turned"};
  if (door->dynamic) {
    put_leaf(*door, within, building, agents, physics);
  } else {
    door->commanded = within;
  }
  return {};
}

void DoorSet::observe(const std::string& name, std::optional<double> opening) {
  Door* door = find(name);
  if (!door || door->dynamic) return;
  if (!opening || !std::isfinite(*opening)) {
    door->seen.reset();
    return;
  }
  door->seen = std::clamp(angle_of(door->hinge, *opening), door->hinge.lower, door->hinge.upper);
}

void DoorSet::keep(const std::vector<Door>& old, Building& building, Agents& agents, Physics& physics) {
  for (Door& door : doors_) {
    const auto before =
        std::find_if(old.begin(), old.end(), [&](const Door& each) { return same_make(each, door); });
    if (before == old.end()) continue;
    door.commanded = before->commanded;
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
      building.move_leaf(door);
    } else if (before->moved) {
      put_leaf(door, before->angle, building, agents, physics);
    }
  }
}

void DoorSet::move(Building& building, Agents& agents, Physics& physics, double dt) {
  for (Door& door : doors_) {
    if (!door.dynamic) {
      move_real_door(door, building, agents, physics, dt);
    } else if (!door.unhinged) {
      drive_hinge(door, physics, dt);
    }
  }
}

void DoorSet::read(Building& building, const Physics& physics, double dt) {
  const auto window = static_cast<std::size_t>(std::max(1L, std::lround(kPullWindow / dt)));
  for (Door& door : doors_) {
    if (!door.dynamic) continue;
    const RigidState rigid = physics.state(door.handle);
    const bool still = rigid.T_map_body.isometry().isApprox(door.rigid.T_map_body.isometry(), 0);
    door.rigid = rigid;
    if (!still) {
      door.moved = true;
      building.move_leaf(door);
    }
    if (door.unhinged) continue;
    const JointState hinge = physics.joint_state(door.joint);
    door.angle = hinge.position;
    door.impulses.resize(window);
    door.impulses[door.next_impulse] = hinge.pull * dt;
    door.next_impulse = (door.next_impulse + 1) % window;
  }
}

void DoorSet::append_states(std::vector<BodyState>& bodies) const {
  for (const Door& door : doors_) {
    if (!door.moved) continue;
    bodies.push_back({door.id, door.epoch, door.rigid.T_map_body, door.rigid.velocity,
                      door.rigid.rotation_rate, door.known});
  }
}

void unhinge(Door& door, Physics& physics) {
  physics.release_joint(door.joint, true);
  physics.drop_leaf(door.handle);
  physics.keep_awake(door.handle, false);
  door.unhinged = door.moved = true;
}

}  // namespace parhelion::simulation
