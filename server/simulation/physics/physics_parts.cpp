#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "server/simulation/physics/physics_world.hpp"

namespace parhelion::simulation {

std::unique_ptr<btCollisionShape> make_part_shape(const PartShape& part) {
  if (!part.hull.empty()) {
    auto hull = std::make_unique<btConvexHullShape>();
    for (const Eigen::Vector3d& corner : part.hull) hull->addPoint(to_bullet(corner), false);
    hull->setMargin(kHullMargin);
    hull->recalcLocalAabb();
    return hull;
  }
  const Eigen::Vector3d& size = part.shape.size;
  switch (part.shape.kind) {
    case ShapeKind::sphere:
      return std::make_unique<btSphereShape>(size.x());
    case ShapeKind::capsule:
      return std::make_unique<btCapsuleShapeZ>(size.x(), size.z());
    case ShapeKind::cylinder:
      return std::make_unique<btCylinderShapeZ>(btVector3(size.x(), size.x(), size.z() / 2));
    case ShapeKind::box:
    case ShapeKind::mesh:  // has a hull
      break;
  }
  return std::make_unique<btBoxShape>(to_bullet(Eigen::Vector3d(size / 2)));
}

namespace {

/// Bullet requires a body's frame at its centre of mass, along its principal axes.
Eigen::Isometry3d inertial_frame(const PartDefinition& part, Eigen::Vector3d& moments) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(part.inertia);
  moments = solver.eigenvalues();
  Eigen::Matrix3d R = solver.eigenvectors();
  if (R.determinant() < 0) R.col(2) = -R.col(2);
  Eigen::Isometry3d T_part_inertial = Eigen::Isometry3d::Identity();
  T_part_inertial.linear() = R;
  T_part_inertial.translation() = part.center;
  return T_part_inertial;
}

}  // namespace

void Runner::sum_up(double step) {
  const bool stands = normal_impulse > 0;
  motion.too_weak = stands && held_by_motor && std::abs(forward_impulse) >= 0.98 * max_impulse;
  motion.speed = speed;
  if (motion.too_weak) motion.speed += std::clamp(ground_moved / normal_impulse - speed, -yield, yield);
  motion.force = forward_impulse / step;
  motion.normal_force = normal_force = normal_impulse / step;
  normal_impulse = forward_impulse = max_impulse = ground_moved = 0;
  held_by_motor = false;
}

std::vector<PhysicsHandle> Physics::add_parts(const std::vector<PartDefinition>& parts,
                                              const std::vector<Transform<Map, Body>>& T_map_part) {
  std::vector<PhysicsHandle> handles;
  const auto first = static_cast<PhysicsHandle>(world_->bodies.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const PartDefinition& part = parts[i];
    Eigen::Vector3d moments;
    const Eigen::Isometry3d T_part_inertial = inertial_frame(part, moments);
    const Eigen::Isometry3d T_inertial_part = T_part_inertial.inverse(Eigen::Isometry);
    auto compound = std::make_unique<btCompoundShape>(false);
    std::vector<std::unique_ptr<btCollisionShape>> children;
    auto surfaces = std::make_unique<PartSurfaces>();
    surfaces->robot = first;
    for (const PartShape& shape : part.shapes) {
      children.push_back(make_part_shape(shape));
      const Eigen::Isometry3d T_part_shape =
          shape.hull.empty() ? shape.shape.T_body_shape.isometry() : Eigen::Isometry3d::Identity();
      compound->addChildShape(to_bullet(T_inertial_part * T_part_shape), children.back().get());
      surfaces->shapes.push_back({shape.friction, shape.runner});
    }
    for (const PartRunner& runner : part.runners) {
      surfaces->runners.emplace_back();
      surfaces->runners.back().axis = to_bullet(Eigen::Vector3d(T_inertial_part.linear() * runner.axis));
      surfaces->runners.back().friction = runner.friction;
    }
    const PhysicsHandle handle = world_->add(
        std::move(compound), part.mass, T_map_part[i].isometry() * T_part_inertial, Eigen::Vector3d::Zero(),
        kRobot, kFixed | kFloor | kFree | kUpright | kKinematic | kRobot | kLeaf, std::move(surfaces));
    RigidBody& rigid = world_->at(handle);
    rigid.children = std::move(children);
    rigid.T_body_inertial = T_part_inertial;
    rigid.body->setMassProps(part.mass, to_bullet(moments));
    rigid.body->updateInertiaTensor();
    rigid.body->setDamping(0, 0.02);
    handles.push_back(handle);
  }
  world_->world.getSolverInfo().m_solverMode |=
      SOLVER_USE_2_FRICTION_DIRECTIONS | SOLVER_ENABLE_FRICTION_DIRECTION_CACHING;
  return handles;
}

void Physics::move_shape(PhysicsHandle part, std::size_t shape,
                         const Transform<Body, ShapeFrame>& T_body_shape) {
  RigidBody& rigid = world_->at(part);
  const Eigen::Isometry3d T_inertial_part = rigid.T_body_inertial.inverse(Eigen::Isometry);
  static_cast<btCompoundShape&>(*rigid.shape)
      .updateChildTransform(static_cast<int>(shape), to_bullet(T_inertial_part * T_body_shape.isometry()),
                            false);
}

void Physics::run(PhysicsHandle part, std::size_t runner, const RunnerCommand& command) {
  RigidBody& rigid = world_->at(part);
  Runner& its = rigid.part->runners[runner];
  its.speed = command.speed;
  its.max_force = command.force;
  its.yield = command.yield;
  its.axis = to_bullet(Eigen::Vector3d(rigid.T_body_inertial.linear().transpose() * command.axis));
}

RunnerMotion Physics::runner(PhysicsHandle part, std::size_t runner) const {
  return world_->at(part).part->runners[runner].motion;
}

void Physics::keep_awake(PhysicsHandle part, bool awake) {
  btRigidBody& body = *world_->at(part).body;
  if (awake) {
    body.setActivationState(DISABLE_DEACTIVATION);
    body.activate(true);
  } else if (body.getActivationState() == DISABLE_DEACTIVATION) {
    body.forceActivationState(ACTIVE_TAG);
    body.setDeactivationTime(0);
  }
}

JointHandle Physics::add_joint(const JointDefinition& definition) {
  RigidBody& a = world_->at(definition.a);
  RigidBody& b = world_->at(definition.b);
  const bool in_tree = world_->sweeps == 0 && a.part && b.part && definition.kind != PartJointKind::ball;
  world_->joints.push_back(std::make_unique<PartJoint>(definition, *a.body, *b.body, a.T_body_inertial,
                                                       b.T_body_inertial, world_->step, in_tree));
  if (world_->sweeps > 0) world_->joints.back()->setOverrideNumSolverIterations(world_->sweeps);
  world_->world.addConstraint(world_->joints.back().get(), true);
  return static_cast<JointHandle>(world_->joints.size()) - 1;
}

void Physics::drive_joint(JointHandle joint, double velocity, double effort) {
  world_->joint(joint).set_motor(velocity, effort);
}

void Physics::release_joint(JointHandle joint, bool released) { world_->joint(joint).setEnabled(!released); }

void Physics::restart_joint(JointHandle joint, double position) { world_->joint(joint).restart(position); }

JointState Physics::joint_state(JointHandle handle) const {
  PartJoint& joint = world_->joint(handle);
  joint.measure();
  return {joint.position(), joint.velocity(), joint.effort(), joint.load(), joint.pull()};
}

void Physics::remove_joint(JointHandle handle) {
  world_->world.removeConstraint(&world_->joint(handle));
  world_->joints[static_cast<std::size_t>(handle)].reset();
}

void Physics::World::collect_runners() {
  for (RigidBody& rigid : bodies) {
    if (!rigid.part || !rigid.body) continue;
    const bool asleep = !rigid.body->isActive();
    for (Runner& runner : rigid.part->runners) {
      runner.sum_up(step);
      if (asleep) runner.motion = {};
    }
  }
}

}  // namespace parhelion::simulation
