#include "server/simulation/robots/robot_twin.hpp"

#include <algorithm>
#include <utility>

#include "protocols/gravity.hpp"

namespace parhelion::simulation {
namespace {

Eigen::Isometry3d joint_motion(const RobotJoint& joint, double position) {
  if (joint.kind != JointKind::prismatic) return turn_about(joint.axis, position);
  return Eigen::Isometry3d(Eigen::Translation3d(position * joint.axis));
}

/// Corners of the box around a shape, in the body's frame.
void append_corners(const Shape& shape, const Eigen::Isometry3d& T_part_body,
                    std::vector<Eigen::Vector3d>& corners) {
  Eigen::Vector3d half = shape.size;
  if (shape.kind == ShapeKind::box || shape.kind == ShapeKind::mesh) half /= 2;
  if (shape.kind == ShapeKind::cylinder) half.z() /= 2;
  if (shape.kind == ShapeKind::capsule) half.z() = half.z() / 2 + half.x();
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d sign(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    corners.push_back(T_part_body * shape.T_body_shape.isometry() * Eigen::Vector3d(sign.cwiseProduct(half)));
  }
}

/// m: no corner of the part's shapes is farther from its origin.
double size_of(const PartDefinition& part) {
  double farthest = 0;
  std::vector<Eigen::Vector3d> corners;
  for (const PartShape& shape : part.shapes) {
    if (shape.hull.empty()) append_corners(shape.shape, Eigen::Isometry3d::Identity(), corners);
    corners.insert(corners.end(), shape.hull.begin(), shape.hull.end());
  }
  for (const Eigen::Vector3d& corner : corners) farthest = std::max(farthest, corner.norm());
  return farthest;
}

}  // namespace

RobotTwin::RobotTwin(std::shared_ptr<const RobotModel> model)
    : model_(std::move(model)), layout_(make_layout(*model_)) {
  JointPosture start;
  for (const RobotJoint& joint : model_->joints) start.positions.push_back(joint.start);
  start.velocities.assign(start.positions.size(), 0);
  set_posture(std::move(start));
  moves_.assign(model_->joints.size(), std::vector<bool>(layout_.parts.size(), false));
  for (const RobotLayout::Joint& joint : layout_.joints) {
    if (!model_->joints[joint.joint].geared) encoded_.push_back(joint.joint);
    for (auto& moved : moves_) moved[joint.b] = moved[joint.b] || moved[joint.a];
    moves_[joint.joint][joint.b] = true;
    if (const auto leader = model_->joints[joint.joint].geared) moves_[*leader][joint.b] = true;
  }
  find_reaches();
  find_fingers();
}

void RobotTwin::find_reaches() {
  // From the ends inwards: what is farthest from a part's origin, with all that it carries.
  std::vector<double> from_part;
  for (const PartDefinition& part : layout_.parts) from_part.push_back(size_of(part));
  reach_.assign(model_->joints.size(), 0);
  for (auto joint = layout_.joints.rbegin(); joint != layout_.joints.rend(); ++joint) {
    const RobotJoint& its = model_->joints[joint->joint];
    const bool slides = its.kind == JointKind::prismatic;
    const double lever = slides ? 1 : from_part[joint->b];
    reach_[joint->joint] += lever;
    if (its.geared) reach_[*its.geared] += std::abs(its.gear_ratio) * lever;
    const double slide = slides ? std::max(std::abs(its.lower), std::abs(its.upper)) : 0;
    from_part[joint->a] = std::max(
        from_part[joint->a], joint->definition.T_a_joint.translation().norm() + slide + from_part[joint->b]);
  }
  base_reach_ = from_part.front();
}

void RobotTwin::find_fingers() {
  for (const std::string& name : model_->gripper) {
    const auto link = std::find_if(model_->links.begin(), model_->links.end(),
                                   [&](const RobotLink& each) { return each.name == name; });
    const auto index = static_cast<std::size_t>(link - model_->links.begin());
    const std::size_t node = layout_.node_of_link[index];
    TwinFinger finger{layout_.nodes[node].part, {}};
    for (const Shape& shape : link->solid.empty() ? link->visible : link->solid)
      append_corners(shape, layout_.T_node_link[index], finger.corners);
    if (fingers_.size() < 2 && !finger.corners.empty() && !layout_.nodes[node].parent)
      fingers_.push_back(std::move(finger));
  }
  if (fingers_.size() < 2) fingers_.clear();
}

bool RobotTwin::is_finger(std::size_t part) const {
  return std::any_of(fingers_.begin(), fingers_.end(),
                     [&](const TwinFinger& finger) { return finger.part == part; });
}

void RobotTwin::follow_leaders(std::vector<double>& values, bool are_velocities) const {
  for (std::size_t i = 0; i < model_->joints.size(); ++i) {
    const RobotJoint& joint = model_->joints[i];
    if (joint.geared)
      values[i] = joint.gear_ratio * values[*joint.geared] + (are_velocities ? 0 : joint.gear_offset);
  }
}

void RobotTwin::set_posture(JointPosture posture) {
  posture_ = std::move(posture);
  follow_leaders(posture_.positions, false);
  follow_leaders(posture_.velocities, true);
}

void RobotTwin::enter(Physics& physics) {
  handles_ = physics.add_kinematic_parts(layout_.parts);
  parts_.resize(handles_.size());
}

void RobotTwin::place(const Transform<Map, Base>& T_map_base, std::span<const double> positions,
                      std::vector<Transform<Map, Body>>& T_map_part) const {
  T_map_part.resize(layout_.parts.size());
  T_map_part.front() = Transform<Map, Body>(T_map_base.isometry());
  for (const RobotLayout::Joint& joint : layout_.joints) {
    const RobotJoint& its = model_->joints[joint.joint];
    T_map_part[joint.b] = Transform<Map, Body>(T_map_part[joint.a].isometry() * joint.definition.T_a_joint *
                                               joint.definition.T_b_joint.inverse(Eigen::Isometry) *
                                               joint_motion(its, positions[joint.joint]));
  }
}

bool RobotTwin::grips(std::size_t joint) const {
  if (fingers_.empty()) return false;
  const auto moves_one = [&](std::size_t i) {
    return moves(i, fingers_[0].part) != moves(i, fingers_[1].part);
  };
  const auto& joints = model_->joints;
  bool follower_moves_one = false;  // then this one moves the other
  for (std::size_t i = 0; i < joints.size(); ++i)
    follower_moves_one = follower_moves_one || (joints[i].geared == joint && moves_one(i));
  return moves_one(joint) || follower_moves_one;
}

/// Velocities from the base outwards (Featherstone, Rigid Body Dynamics Algorithms, section 5.3).
void RobotTwin::move(Physics& physics, const RigidState& base, bool touchable) {
  place(Transform<Map, Base>(base.T_map_body.isometry()), posture_.positions, poses_);
  parts_.front() = base;
  for (const RobotLayout::Joint& joint : layout_.joints) {
    const RobotJoint& its = model_->joints[joint.joint];
    const RigidState& carrier = parts_[joint.a];
    RigidState& part = parts_[joint.b];
    part.T_map_body = poses_[joint.b];
    const Eigen::Vector3d arm = part.T_map_body.translation() - carrier.T_map_body.translation();
    const Eigen::Vector3d along = part.T_map_body.rotation() * its.axis * posture_.velocities[joint.joint];
    const bool slides = its.kind == JointKind::prismatic;
    part.velocity = carrier.velocity + carrier.rotation_rate.cross(arm);
    part.rotation_rate = carrier.rotation_rate;
    (slides ? part.velocity : part.rotation_rate) += along;
  }
  for (std::size_t i = 0; i < handles_.size(); ++i) {
    physics.suspend(handles_[i], !touchable);
    physics.move_kinematic(handles_[i], parts_[i].T_map_body, parts_[i].velocity, parts_[i].rotation_rate);
  }
}

void RobotTwin::suspend(Physics& physics) {
  for (const PhysicsHandle handle : handles_) physics.suspend(handle, true);
}

double RobotTwin::bears(std::size_t joint, double load, const Eigen::Vector3d& center) const {
  const auto its = std::find_if(layout_.joints.begin(), layout_.joints.end(),
                                [&](const RobotLayout::Joint& each) { return each.joint == joint; });
  if (its == layout_.joints.end()) return 0;
  const RigidState& part = parts_[its->b];
  const RobotJoint& described = model_->joints[joint];
  const Eigen::Vector3d axis = part.T_map_body.rotation() * described.axis;
  const Eigen::Vector3d pivot = part.T_map_body.translation();
  double sum = 0;
  const auto add = [&](double mass, const Eigen::Vector3d& at) {
    const Eigen::Vector3d weight(0, 0, -mass * kGravity);
    sum += described.kind == JointKind::prismatic ? axis.dot(weight) : axis.dot((at - pivot).cross(weight));
  };
  for (std::size_t i = 0; i < parts_.size(); ++i)
    if (moves_[joint][i]) add(layout_.parts[i].mass, parts_[i].T_map_body * layout_.parts[i].center);
  add(load, center);
  return std::abs(sum);
}

Eigen::Isometry3d RobotTwin::T_part_node(std::size_t index) const {
  const RobotNode& node = layout_.nodes[index];
  if (!node.parent) return Eigen::Isometry3d::Identity();
  return T_part_node(*node.parent) * node.T_parent_node *
         turn_about(node.axis, posture_.positions[node.link - 1]);
}

std::vector<std::shared_ptr<const BodyDefinition>> RobotTwin::bodies(const std::string& entity,
                                                                     BodyId first) const {
  std::vector<std::shared_ptr<const BodyDefinition>> bodies;
  for (const RobotNode& node : layout_.nodes) {
    bodies.push_back(std::make_shared<const BodyDefinition>(BodyDefinition{
        first++, entity, model_->links[node.link].name, BodyOwner::real_robot, false, node.visible, false}));
  }
  return bodies;
}

void RobotTwin::append_states(BodyId first, std::uint32_t epoch, std::vector<BodyState>& bodies) const {
  for (std::size_t i = 0; i < layout_.nodes.size(); ++i) {
    const RigidState& part = parts_[layout_.nodes[i].part];
    const Transform<Map, Body> T_map_body(part.T_map_body.isometry() * T_part_node(i));
    const Eigen::Vector3d arm = T_map_body.translation() - part.T_map_body.translation();
    bodies.push_back({first + static_cast<BodyId>(i), epoch, T_map_body,
                      part.velocity + part.rotation_rate.cross(arm), part.rotation_rate, true});
  }
}

}  // namespace parhelion::simulation
