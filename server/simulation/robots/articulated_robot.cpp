#include "server/simulation/robots/articulated_robot.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/simulation/robots/base_body.hpp"

namespace parhelion::simulation {
namespace {

Eigen::Isometry3d joint_motion(const RobotJoint& joint, double position) {
  if (joint.kind != JointKind::prismatic) return turn_about(joint.axis, position);
  return Eigen::Isometry3d(Eigen::Translation3d(position * joint.axis));
}

}  // namespace

ArticulatedRobot::ArticulatedRobot(std::shared_ptr<const RobotModel> model)
    : model_(std::move(model)), layout_(make_layout(*model_)) {
  servos_.resize(layout_.joints.size());
  gears_.resize(layout_.joints.size());
  for (std::size_t i = 0; i < gears_.size(); ++i) {
    const auto leader = model_->joints[layout_.joints[i].joint].geared;
    for (std::size_t other = 0; leader && other < gears_.size(); ++other) {
      if (layout_.joints[other].joint != *leader) continue;
      const RobotJoint& follower = model_->joints[layout_.joints[i].joint];
      gears_[i] = Gear{other, true, follower.gear_ratio, follower.gear_offset};
      gears_[other] = Gear{i, false, 1 / follower.gear_ratio, -follower.gear_offset / follower.gear_ratio};
    }
  }
  steering_.assign(model_->joints.size(), 0);
  for (const std::size_t joint : layout_.steering) motion_.joints.names.push_back(model_->joints[joint].name);
  for (const auto& joint : layout_.joints) motion_.joints.names.push_back(model_->joints[joint.joint].name);
  const std::size_t count = motion_.joints.names.size();
  motion_.joints.positions.assign(count, 0);
  motion_.joints.velocities.assign(count, 0);
  motion_.joints.efforts.assign(count, 0);
  motion_.broken.assign(count, false);
  start_again();
}

void ArticulatedRobot::start_again() {
  const std::size_t runners = layout_.runners.size();
  rolled_.assign(runners, 0);
  turned_.assign(runners, 0);
  runner_speed_.assign(runners, 0);
  for (const std::size_t joint : layout_.steering) steering_[joint] = model_->joints[joint].start;
  for (std::size_t i = 0; i < servos_.size(); ++i) {
    const RobotJoint& joint = model_->joints[layout_.joints[i].joint];
    servos_[i] = Servo{};
    servos_[i].target = joint.start;
    servos_[i].max_speed = joint.velocity;
  }
}

std::vector<Transform<Map, Body>> ArticulatedRobot::part_poses(const Transform<Map, Base>& T_map_base) const {
  std::vector<Transform<Map, Body>> poses(layout_.parts.size());
  poses[0] = body_of(T_map_base);
  for (const RobotLayout::Joint& joint : layout_.joints) {
    const RobotJoint& its = model_->joints[joint.joint];
    const Eigen::Isometry3d T_a_b = joint.definition.T_a_joint *
                                    joint.definition.T_b_joint.inverse(Eigen::Isometry) *
                                    joint_motion(its, its.start);
    poses[joint.b] = Transform<Map, Body>(poses[joint.a].isometry() * T_a_b);
  }
  return poses;
}

void ArticulatedRobot::enter(Physics& physics, const Transform<Map, Base>& T_map_base) {
  handles_ = physics.add_parts(layout_.parts, part_poses(T_map_base));
  for (const RobotLayout::Joint& joint : layout_.joints) {
    JointDefinition definition = joint.definition;
    definition.a = handles_[joint.a];
    definition.b = handles_[joint.b];
    joint_handles_.push_back(physics.add_joint(definition));
  }
  put(physics, T_map_base);
}

void ArticulatedRobot::leave(Physics& physics) {
  for (const JointHandle joint : joint_handles_) physics.remove_joint(joint);
  for (const PhysicsHandle handle : handles_) physics.remove(handle);
}

void ArticulatedRobot::put(Physics& physics, const Transform<Map, Base>& T_map_base) {
  start_again();
  const auto poses = part_poses(T_map_base);
  parts_.resize(handles_.size());
  for (std::size_t i = 0; i < handles_.size(); ++i) {
    physics.teleport(handles_[i], poses[i]);
    parts_[i] = {poses[i], Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  }
  for (std::size_t i = 0; i < joint_handles_.size(); ++i) {
    physics.release_joint(joint_handles_[i], false);
    physics.restart_joint(joint_handles_[i], servos_[i].target);
  }
  motion_.T_map_base = T_map_base;
  motion_.velocity = motion_.rotation_rate = motion_.acceleration = Eigen::Vector3d::Zero();
  motion_.left = motion_.right = 0;
  motion_.touching.clear();
  ++motion_.epoch;
  awake_until_.reset();
}

void ArticulatedRobot::restore(Physics& physics) {
  const RobotMotion before = motion_;
  const auto rolled = rolled_, turned = turned_;
  // Reassembles the parts at base_link's pose, without reporting a jump.
  put(physics, motion_.T_map_base);
  rolled_ = rolled;
  turned_ = turned;
  motion_.left = before.left;
  motion_.right = before.right;
}

const std::string& ArticulatedRobot::link_name(PhysicsHandle handle, int shape) const {
  const auto part = static_cast<std::size_t>(handle - handles_.front());
  const auto& solids = layout_.solids[part];
  if (shape >= 0 && static_cast<std::size_t>(shape) < solids.size())
    return model_->links[solids[static_cast<std::size_t>(shape)].link].name;
  const auto first = std::find_if(layout_.nodes.begin(), layout_.nodes.end(),
                                  [&](const RobotNode& node) { return node.part == part; });
  return model_->links[first->link].name;
}

void ArticulatedRobot::observe(Physics& physics, SimulationTime, double dt,
                               std::vector<JointIncident>& incidents) {
  for (std::size_t i = 0; i < handles_.size(); ++i) parts_[i] = physics.state(handles_[i]);
  const RigidState& base_state = parts_[0];
  motion_.T_map_base = base_of(base_state.T_map_body);
  motion_.acceleration = (base_state.velocity - motion_.velocity) / dt;
  motion_.velocity = base_state.velocity;
  motion_.rotation_rate = base_state.rotation_rate;
  motion_.touching.clear();
  double left = 0, right = 0;
  int lefts = 0, rights = 0;
  for (std::size_t i = 0; i < layout_.runners.size(); ++i) {
    const RobotRunner& runner = model_->drive.runners[i];
    runner_speed_[i] = physics.runner(handles_[layout_.runners[i].part], layout_.runners[i].index).speed;
    rolled_[i] += runner_speed_[i] * dt;
    if (runner.kind == RobotRunner::Kind::wheel)
      turned_[i] = wrap_angle(turned_[i] + runner_speed_[i] * dt / runner.radius);
    // Only unsteered runners of the base part have encoders for odometry.
    if (runner.steering || layout_.runners[i].part != 0) continue;
    (runner.side > 0 ? left : right) += rolled_[i];
    ++(runner.side > 0 ? lefts : rights);
  }
  motion_.left = left / std::max(1, lefts);
  motion_.right = right / std::max(1, rights);
  std::size_t n = 0;
  for (const std::size_t joint : layout_.steering) {
    motion_.joints.velocities[n] = (steering_[joint] - motion_.joints.positions[n]) / dt;
    motion_.joints.positions[n++] = steering_[joint];
  }
  for (std::size_t i = 0; i < servos_.size(); ++i, ++n) {
    watch_joint(physics, i, dt, incidents);
    const JointState state = physics.joint_state(joint_handles_[i]);
    motion_.joints.positions[n] = state.position;
    motion_.joints.velocities[n] = state.velocity;
    motion_.joints.efforts[n] = state.effort;
    motion_.broken[n] = servos_[i].broken;
  }
}

double ArticulatedRobot::drive_power(const Physics& physics) const {
  double power = 0;
  for (const RobotLayout::Runner& place : layout_.runners) {
    const RunnerMotion runner = physics.runner(handles_[place.part], place.index);
    power += std::max(0.0, runner.force * runner.speed);
  }
  return power;
}

double ArticulatedRobot::mass() const {
  double sum = 0;
  for (const PartDefinition& part : layout_.parts) sum += part.mass;
  return sum;
}

Eigen::Isometry3d ArticulatedRobot::T_part_node(std::size_t index) const {
  const RobotNode& node = layout_.nodes[index];
  if (!node.parent) return Eigen::Isometry3d::Identity();
  double angle = 0;
  if (node.steering) angle = steering_[*node.steering];
  if (node.runner) {
    const Eigen::Vector3d axis = layout_.runners[*node.runner].axis;
    angle = turned_[*node.runner] * (axis.dot(node.axis) < 0 ? -1 : 1);
  }
  return T_part_node(*node.parent) * node.T_parent_node * turn_about(node.axis, angle);
}

std::vector<BodyDefinition> ArticulatedRobot::bodies(const std::string& entity, BodyId first,
                                                     BodyOwner owner) const {
  std::vector<BodyDefinition> bodies;
  for (const RobotNode& node : layout_.nodes) {
    bodies.push_back(
        {first++, entity, model_->links[node.link].name, owner, owner == BodyOwner::agent, node.visible});
  }
  return bodies;
}

void ArticulatedRobot::append_states(BodyId first, std::uint32_t epoch,
                                     std::vector<BodyState>& bodies) const {
  for (std::size_t i = 0; i < layout_.nodes.size(); ++i) {
    const RobotNode& node = layout_.nodes[i];
    const RigidState& part = parts_[node.part];
    BodyState state;
    state.id = first + static_cast<BodyId>(i);
    state.epoch = epoch;
    state.T_map_body = Transform<Map, Body>(part.T_map_body.isometry() * T_part_node(i));
    const Eigen::Vector3d arm = state.T_map_body.translation() - part.T_map_body.translation();
    state.velocity = part.velocity + part.rotation_rate.cross(arm);
    state.rotation_rate = part.rotation_rate;
    if (node.runner) {
      const RobotRunner& runner = model_->drive.runners[*node.runner];
      state.rotation_rate += state.T_map_body.rotation() * layout_.runners[*node.runner].axis *
                             (runner_speed_[*node.runner] / runner.radius);
    }
    bodies.push_back(state);
  }
}

Eigen::Vector3d ArticulatedRobot::gripper_center() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t link = 0; link < model_->links.size(); ++link) {
    const RobotLink& its = model_->links[link];
    if (std::find(model_->gripper.begin(), model_->gripper.end(), its.name) == model_->gripper.end())
      continue;
    const std::size_t node = layout_.node_of_link[link];
    sum += parts_[layout_.nodes[node].part].T_map_body.isometry() * T_part_node(node) *
           layout_.T_node_link[link] * its.center;
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, model_->gripper.size()));
}

void ArticulatedRobot::touched(const std::string& link) {
  const auto& bumpers = model_->bumpers;
  const auto at = std::find(bumpers.begin(), bumpers.end(), link);
  if (at == bumpers.end()) return;
  const auto before = [&](const std::string& a, const std::string& b) {
    return std::find(bumpers.begin(), bumpers.end(), a) < std::find(bumpers.begin(), bumpers.end(), b);
  };
  auto& touching = motion_.touching;
  const auto place = std::lower_bound(touching.begin(), touching.end(), link, before);
  if (place == touching.end() || *place != link) touching.insert(place, link);
}

}  // namespace parhelion::simulation
