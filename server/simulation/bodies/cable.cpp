#include "server/simulation/bodies/cable.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocols/gravity.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kLinkLength = 0.06;  // m, approximate
constexpr std::size_t kMinLinks = 4, kMaxLinks = 40;
constexpr double kDensity = 2000;  // kg/m^3: copper in rubber
constexpr double kFriction = 0.7;  // against anything
constexpr double kBending =
    0.02;  // friction torque of a joint, in units of the cable's weight times a link's length

const Material kSheath{{0.35F, 0.10F, 0.02F}, 0.7F, 0, 0.3F};

/// A capsule along x.
Shape link_shape(const CableForm& form) {
  const Eigen::Quaterniond lying(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY()));
  return {ShapeKind::capsule,
          {form.radius, form.radius, form.pitch},
          Transform<Body, ShapeFrame>(lying, Eigen::Vector3d::Zero()),
          kSheath};
}

}  // namespace

CableForm cable_form(const Eigen::Vector3d& size) {
  CableForm form;
  form.links = static_cast<std::size_t>(std::clamp(
      std::round(size.x() / kLinkLength), static_cast<double>(kMinLinks), static_cast<double>(kMaxLinks)));
  form.pitch = size.x() / static_cast<double>(form.links);
  form.radius = size.y() / 2;
  form.mass = kDensity * std::numbers::pi * form.radius * form.radius * size.x();
  return form;
}

Status check_cable(const std::string& agent, const Eigen::Vector3d& size) {
  const bool fits = size.allFinite() && size.x() >= 0.2 && size.x() <= 10 && size.y() >= 0.01 &&
                    size.y() <= 0.1 && size.x() >= 8 * size.y() && size.y() == size.z();
  if (fits) return {};
  return Error{"agent '" + agent + "': size " + std::to_string(size.x()) + " x " + std::to_string(size.y()) +
               " x " + std::to_string(size.z()) +
               " m; for a cable this is its length (0.2 to 10 m) and twice its diameter (1 to 10 cm, at most "
               "an eighth of the length)"};
}

std::vector<BodyDefinition> cable_bodies(const Eigen::Vector3d& size) {
  const CableForm form = cable_form(size);
  std::vector<BodyDefinition> bodies(form.links);
  for (std::size_t i = 0; i < form.links; ++i) {
    bodies[i].part = "link_" + std::to_string(i + 1);
    bodies[i].shapes = {link_shape(form)};
  }
  return bodies;
}

void cable_poses(const Eigen::Vector3d& size, std::vector<Transform<Base, Body>>& poses) {
  const CableForm form = cable_form(size);
  for (std::size_t i = 0; i < form.links; ++i) {
    const double x = (static_cast<double>(i) + 0.5) * form.pitch - size.x() / 2;
    poses.emplace_back(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0, form.radius));
  }
}

void Cable::enter(Physics& physics) {
  PartDefinition link;
  link.shapes = {{link_shape(form_), {}, kFriction, -1}};
  link.mass = form_.mass / static_cast<double>(form_.links);
  // Inertia of a rod; the moment about its own axis has a lower bound, for the solver's stability.
  const double across = link.mass * (form_.pitch * form_.pitch / 12 + form_.radius * form_.radius / 4);
  link.inertia = Eigen::Vector3d(across / 2, across, across).asDiagonal();
  handles_ = physics.add_parts(std::vector<PartDefinition>(form_.links, link),
                               std::vector<Transform<Map, Body>>(form_.links));
  for (std::size_t i = 1; i < handles_.size(); ++i) {
    JointDefinition joint;
    joint.kind = PartJointKind::ball;
    joint.a = handles_[i - 1];
    joint.b = handles_[i];
    joint.T_a_joint.translation().x() = form_.pitch / 2;
    joint.T_b_joint.translation().x() = -form_.pitch / 2;
    joints_.push_back(physics.add_joint(joint));
    physics.drive_joint(joints_.back(), 0, kBending * kGravity * form_.mass * form_.pitch);
  }
}

void Cable::leave(Physics& physics) {
  for (const JointHandle joint : joints_) physics.remove_joint(joint);
  for (const PhysicsHandle handle : handles_) physics.remove(handle);
}

void Cable::put(Physics& physics, const Transform<Map, Base>& T_map_base) {
  std::vector<Transform<Base, Body>> poses;
  cable_poses(size_, poses);
  states_.clear();
  for (std::size_t i = 0; i < handles_.size(); ++i) {
    physics.teleport(handles_[i], T_map_base * poses[i]);
    states_.push_back({T_map_base * poses[i], Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
  }
  for (const JointHandle joint : joints_) physics.restart_joint(joint, 0);
}

bool Cable::observe(Physics& physics) {
  bool moved = false;
  for (std::size_t i = 0; i < handles_.size(); ++i) {
    const RigidState state = physics.state(handles_[i]);
    moved = moved || !state.T_map_body.isometry().isApprox(states_[i].T_map_body.isometry(), 0);
    states_[i] = state;
  }
  return moved;
}

std::vector<Eigen::Vector3d> Cable::points() const {
  std::vector<Eigen::Vector3d> points;
  for (const RigidState& state : states_) {
    for (const double end : {-0.5, 0.5})
      points.push_back(state.T_map_body * Eigen::Vector3d(end * form_.pitch, 0, 0));
  }
  return points;
}

void Cable::append_states(BodyId first, std::uint32_t epoch, std::vector<BodyState>& bodies) const {
  for (const RigidState& state : states_)
    bodies.push_back({first++, epoch, state.T_map_body, state.velocity, state.rotation_rate, true});
}

}  // namespace parhelion::simulation
