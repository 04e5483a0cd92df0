#include "server/simulation/physics/physics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "protocols/gravity.hpp"
#include "server/simulation/physics/physics_world.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kSettled = 1e-5;  // m/s and rad/s: a smaller change ends the iterations
constexpr double kLean = 2e-4;     // rad: small compared with friction
constexpr double kPress = 1e-4;    // m: penetration forced to find the contact points
constexpr double kStanding =
    0.5;  // of a normal's z: from this on a wheel stands on a body instead of hitting it

/// A plane is infinite: bodies farther above it than the contact range are skipped.
void look_at_pair(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, const btDispatcherInfo& info) {
  const auto is_above = [](const btBroadphaseProxy& plane, const btBroadphaseProxy& other) {
    const btCollisionShape& shape =
        *static_cast<btCollisionObject*>(plane.m_clientObject)->getCollisionShape();
    return shape.getShapeType() == STATIC_PLANE_PROXYTYPE &&
           other.m_aabbMin.z() > static_cast<const btStaticPlaneShape&>(shape).getPlaneConstant();
  };
  if (!is_above(*pair.m_pProxy0, *pair.m_pProxy1) && !is_above(*pair.m_pProxy1, *pair.m_pProxy0))
    return btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
  if (pair.m_algorithm == nullptr) return;
  pair.m_algorithm->~btCollisionAlgorithm();
  dispatcher.freeCollisionAlgorithm(pair.m_algorithm);
  pair.m_algorithm = nullptr;
}

}  // namespace

Physics::World::World(double step_s, int joint_sweeps)
    : step(step_s),
      sweeps(joint_sweeps),
      dispatcher(&configuration),
      world(&dispatcher, &broadphase, &solver, &configuration) {
  dispatcher.setNearCallback(look_at_pair);
  world.getPairCache()->setOverlapFilterCallback(&filter);
  world.setGravity({0, 0, -kGravity});
  world.setForceUpdateAllAabbs(false);
  world.getDispatchInfo().m_useContinuous = false;  // there are no predicted poses
  btContactSolverInfo& settings = world.getSolverInfo();
  settings.m_numIterations = 10;
  settings.m_minimumSolverBatchSize = 1;  // each island separately: cables and doors take more iterations
  settings.m_solverMode = SOLVER_USE_WARMSTARTING;  // no random order, no CPU-dependent code paths
  settings.m_splitImpulse = 1;                      // corrects penetration without adding speed
  settings.m_splitImpulsePenetrationThreshold = 0;
  settings.m_erp2 = 0.2;
  settings.m_restitution = 0;
  settings.m_warmstartingFactor = 0.85;
  settings.m_leastSquaresResidualThreshold = kSettled * kSettled;
}

Physics::World::~World() {
  for (const auto& joint : joints) {
    if (joint) world.removeConstraint(joint.get());
  }
  for (RigidBody& rigid : bodies) {
    if (rigid.body && !rigid.suspended) world.removeRigidBody(rigid.body.get());
  }
}

void Physics::World::wake_neighbours(const btRigidBody& body) {
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    if (manifold.getBody0() != &body && manifold.getBody1() != &body) continue;
    const btCollisionObject* other = manifold.getBody0() == &body ? manifold.getBody1() : manifold.getBody0();
    at(other->getUserIndex()).body->activate();
  }
  // A body sleeping on a fixed body since its placement has no contact with it, only overlapping boxes.
  const btBroadphasePairArray& pairs = world.getPairCache()->getOverlappingPairArray();
  const auto object = [](const btBroadphaseProxy* proxy) {
    return static_cast<btCollisionObject*>(proxy->m_clientObject);
  };
  for (int i = 0; body.isStaticObject() && i < pairs.size(); ++i) {
    btCollisionObject *a = object(pairs[i].m_pProxy0), *b = object(pairs[i].m_pProxy1);
    if (a == &body) b->activate();
    if (b == &body) a->activate();
  }
}

void Physics::World::forget_joint_positions() {
  for (const auto& joint : joints) {
    if (joint) joint->moved();
  }
}

void Physics::World::settle() {
  std::erase_if(put_down, [&](PhysicsHandle handle) {
    const auto& body = bodies[static_cast<std::size_t>(handle)].body;
    return !body || body->isActive();
  });
  if (put_down.empty()) return;
  for (const PhysicsHandle handle : put_down) world.updateSingleAabb(at(handle).body.get());
  broadphase.calculateOverlappingPairs(&dispatcher);
  for (const PhysicsHandle handle : put_down) meet_neighbours(*at(handle).body);
  put_down.clear();
}

void Physics::World::meet_neighbours(btRigidBody& body) {
  const btTransform rest = body.getWorldTransform();
  btBroadphasePairArray& pairs = world.getPairCache()->getOverlappingPairArray();
  body.forceActivationState(ACTIVE_TAG);
  // Tilted towards each corner in turn, and slightly lower: one test finds only the deepest corner.
  for (const double about_x : {-kLean, kLean}) {
    for (const double about_y : {-kLean, kLean}) {
      const btMatrix3x3 lean(btQuaternion(about_y, about_x, 0));
      body.setWorldTransform(btTransform(lean * rest.getBasis(), rest.getOrigin() - btVector3(0, 0, kPress)));
      for (int i = 0; i < pairs.size(); ++i) {
        if (pairs[i].m_pProxy0->m_clientObject == &body || pairs[i].m_pProxy1->m_clientObject == &body)
          dispatcher.getNearCallback()(pairs[i], dispatcher, world.getDispatchInfo());
      }
    }
  }
  body.setWorldTransform(rest);
  body.forceActivationState(ISLAND_SLEEPING);
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    if (manifold.getBody0() == &body || manifold.getBody1() == &body)
      manifold.refreshContactPoints(manifold.getBody0()->getWorldTransform(),
                                    manifold.getBody1()->getWorldTransform());
  }
}

void Physics::World::collect_contacts() {
  contacts.clear();
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    PhysicsContact contact;
    contact.a = manifold.getBody0()->getUserIndex();
    contact.b = manifold.getBody1()->getUserIndex();
    if (at(contact.a).group == kFloor || at(contact.b).group == kFloor) continue;
    double deepest = 0;
    bool touching = false, rolling = true, standing = true;
    for (int p = 0; p < manifold.getNumContacts(); ++p) {
      const btManifoldPoint& point = manifold.getContactPoint(p);
      if (!(point.getAppliedImpulse() > 0)) continue;  // close, without force
      contact.impulse += point.getAppliedImpulse();
      if (!touching || point.getDistance() < deepest) {
        deepest = point.getDistance();
        contact.position = from_bullet(point.getPositionWorldOnB());
        if (at(contact.a).part) contact.shape_a = point.m_index0;
        if (at(contact.b).part) contact.shape_b = point.m_index1;
        touching = true;
      }
      const bool rolls = point.m_contactPointFlags & kRollingPoint;
      rolling = rolling && rolls;
      standing = standing && rolls && std::abs(point.m_normalWorldOnB.z()) > kStanding;
    }
    if (!touching) continue;
    contact.rolling = rolling;
    // Wheels on fixed ground: not a collision.
    if (standing && (at(contact.a).group == kFixed || at(contact.b).group == kFixed)) continue;
    if (contact.a > contact.b) {
      std::swap(contact.a, contact.b);
      std::swap(contact.shape_a, contact.shape_b);
    }
    contacts.push_back(contact);
  }
}

Physics::Physics(double step, int sweeps) : world_(std::make_unique<World>(step, sweeps)) {}
Physics::~Physics() = default;

void Physics::teleport(PhysicsHandle handle, const Transform<Map, Body>& T_map_body) {
  RigidBody& rigid = world_->at(handle);
  btRigidBody& body = *rigid.body;
  const btTransform pose = to_bullet(rigid.part ? T_map_body.isometry() * rigid.T_body_inertial
                                                : T_map_body.isometry() * Eigen::Translation3d(rigid.center));
  body.setCenterOfMassTransform(pose);
  body.setInterpolationWorldTransform(pose);
  body.setLinearVelocity({0, 0, 0});
  body.setAngularVelocity({0, 0, 0});
  body.clearForces();
  world_->forget_joint_positions();
  if (rigid.suspended) return;
  world_->wake_neighbours(body);
  // Cached contacts of the old pose must not act at the new one.
  world_->broadphase.getOverlappingPairCache()->cleanProxyFromPairs(body.getBroadphaseHandle(),
                                                                    &world_->dispatcher);
  world_->world.updateSingleAabb(&body);
  if (rigid.group == kFree) {
    body.forceActivationState(ISLAND_SLEEPING);
    world_->put_down.push_back(handle);
  }
  if (rigid.group == kRobot) body.activate(true);
}

void Physics::set_motion(PhysicsHandle handle, const RigidState& motion) {
  teleport(handle, motion.T_map_body);
  RigidBody& rigid = world_->at(handle);
  const Eigen::Vector3d arm = motion.T_map_body.rotation() * rigid.center;
  rigid.body->setLinearVelocity(
      to_bullet(Eigen::Vector3d(motion.velocity + motion.rotation_rate.cross(arm))));
  rigid.body->setAngularVelocity(to_bullet(motion.rotation_rate));
  world_->forget_joint_positions();
}

void Physics::move_kinematic(PhysicsHandle handle, const Transform<Map, Body>& T_map_body,
                             const Eigen::Vector3d& velocity, const Eigen::Vector3d& rotation_rate) {
  btRigidBody& body = *world_->at(handle).body;
  const btTransform pose = to_bullet(T_map_body.isometry());
  // Bullet computes a kinematic body's velocity from the step between these two poses.
  btTransform before;
  btTransformUtil::integrateTransform(pose, -to_bullet(velocity), -to_bullet(rotation_rate), world_->step,
                                      before);
  body.setWorldTransform(pose);
  body.setInterpolationWorldTransform(before);
}

void Physics::move_fixed(PhysicsHandle handle, const Transform<Map, Body>& T_map_body,
                         const Eigen::Vector3d& velocity, const Eigen::Vector3d& rotation_rate) {
  RigidBody& rigid = world_->at(handle);
  btRigidBody& body = *rigid.body;
  if (!body.isKinematicObject()) {
    // Re-added, because the world keeps kinematic and static bodies in separate lists.
    world_->world.removeRigidBody(&body);
    body.setCollisionFlags((body.getCollisionFlags() & ~btCollisionObject::CF_STATIC_OBJECT) |
                           btCollisionObject::CF_KINEMATIC_OBJECT);
    world_->world.addRigidBody(&body, rigid.group, rigid.mask);
  }
  world_->wake_neighbours(body);
  move_kinematic(handle, T_map_body, velocity, rotation_rate);
  body.activate(true);
}

void Physics::suspend(PhysicsHandle handle, bool suspended) {
  RigidBody& rigid = world_->at(handle);
  if (rigid.suspended == suspended) return;
  rigid.suspended = suspended;
  if (suspended) {
    world_->world.removeRigidBody(rigid.body.get());
  } else {
    world_->world.addRigidBody(rigid.body.get(), rigid.group, rigid.mask);
  }
}

void Physics::drive(PhysicsHandle handle, const Twist2& twist, double friction) {
  RigidState moving = state(handle);
  drive(moving, twist, friction, world_->step);
  btRigidBody& body = *world_->at(handle).body;
  body.setLinearVelocity(to_bullet(moving.velocity));
  body.setAngularVelocity(to_bullet(moving.rotation_rate));
}

void Physics::drive(RigidState& rigid, const Twist2& twist, double friction, double step) {
  const Eigen::Isometry3d& T = rigid.T_map_body.isometry();
  Eigen::Vector2d change = (T.linear() * Eigen::Vector3d(twist.vx, twist.vy, 0) - rigid.velocity).head<2>();
  // Coulomb: floor friction is at most mu * m * g in the plane, in any direction.
  const double max_change = friction * kGravity * step;
  const double length = change.norm();
  if (length > max_change) change *= max_change / length;
  rigid.velocity.head<2>() += change;
  // The same force at a lever of 0.2 m on a body with a radius of gyration of about 0.2 m.
  const double turn = std::clamp(twist.wz - rigid.rotation_rate.z(), -max_change / 0.2, max_change / 0.2);
  rigid.rotation_rate = {0, 0, rigid.rotation_rate.z() + turn};
}

void Physics::step() {
  world_->settle();
  world_->world.stepSimulation(world_->step, 0);
  world_->forget_joint_positions();
  world_->collect_contacts();
  world_->collect_runners();
}

RigidState Physics::state(PhysicsHandle handle) const {
  const RigidBody& rigid = world_->at(handle);
  RigidState state;
  const Eigen::Isometry3d T_map_inertial = from_bullet(rigid.body->getWorldTransform());
  state.T_map_body =
      Transform<Map, Body>(rigid.part ? T_map_inertial * rigid.T_body_inertial.inverse(Eigen::Isometry)
                                      : T_map_inertial * Eigen::Translation3d(-rigid.center));
  state.rotation_rate = from_bullet(rigid.body->getAngularVelocity());
  const Eigen::Vector3d arm = -(state.T_map_body.rotation() * rigid.center);
  state.velocity = from_bullet(rigid.body->getLinearVelocity()) + state.rotation_rate.cross(arm);
  return state;
}

const std::vector<PhysicsContact>& Physics::contacts() const { return world_->contacts; }

}  // namespace parhelion::simulation
