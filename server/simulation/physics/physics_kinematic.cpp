// Parts of real robots, what they move_held, and distances between bodies.
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>

#include <algorithm>
#include <utility>

#include "server/simulation/physics/physics_world.hpp"

namespace parhelion::simulation {
namespace {

constexpr int kMovable = kFree | kUpright | kRobot | kLeaf;

btTransform shape_pose(const RigidBody& rigid, const Transform<Map, Body>& T_map_body) {
  return to_bullet(rigid.part ? T_map_body.isometry() * rigid.T_body_inertial
                              : T_map_body.isometry() * Eigen::Translation3d(rigid.center));
}

/// Calls visit(const btConvexShape&, const btTransform&) for each convex shape of a body.
template <class Visit>
void for_each_convex(const btCollisionShape& shape, const btTransform& pose, Visit&& visit) {
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int i = 0; i < compound.getNumChildShapes(); ++i)
      for_each_convex(*compound.getChildShape(i), pose * compound.getChildTransform(i), visit);
  } else if (shape.isConvex()) {
    visit(static_cast<const btConvexShape&>(shape), pose);
  }
}

double convex_distance(const btConvexShape& a, const btTransform& pose_a, const btConvexShape& b,
                       const btTransform& pose_b, double limit) {
  btVoronoiSimplexSolver simplex;
  btGjkEpaPenetrationDepthSolver penetration;
  btGjkPairDetector detector(&a, &b, &simplex, &penetration);
  btGjkPairDetector::ClosestPointInput input;
  input.m_transformA = pose_a;
  input.m_transformB = pose_b;
  btPointCollector nearest;
  detector.getClosestPoints(input, nearest, nullptr);
  return nearest.m_hasResult ? std::min<double>(nearest.m_distance, limit) : limit;
}

bool spheres_apart(const btCollisionShape& a, const btTransform& pose_a, const btCollisionShape& b,
                   const btTransform& pose_b, double limit) {
  btVector3 center_a, center_b;
  btScalar radius_a = 0, radius_b = 0;
  a.getBoundingSphere(center_a, radius_a);
  b.getBoundingSphere(center_b, radius_b);
  return (pose_a * center_a).distance(pose_b * center_b) > radius_a + radius_b + limit;
}

}  // namespace

std::vector<PhysicsHandle> Physics::add_kinematic_parts(const std::vector<PartDefinition>& parts) {
  std::vector<PhysicsHandle> handles;
  for (const PartDefinition& part : parts) {
    auto compound = std::make_unique<btCompoundShape>(false);
    std::vector<std::unique_ptr<btCollisionShape>> children;
    for (const PartShape& shape : part.shapes) {
      children.push_back(make_part_shape(shape));
      compound->addChildShape(
          to_bullet(shape.hull.empty() ? shape.shape.T_body_shape.isometry() : Eigen::Isometry3d::Identity()),
          children.back().get());
    }
    const PhysicsHandle handle = world_->add(std::move(compound), 0, Eigen::Isometry3d::Identity(),
                                             Eigen::Vector3d::Zero(), kKinematic, kMovable);
    world_->at(handle).children = std::move(children);
    world_->make_kinematic(handle);
    suspend(handle, true);
    handles.push_back(handle);
  }
  return handles;
}

void Physics::World::make_kinematic(PhysicsHandle handle) {
  RigidBody& rigid = at(handle);
  rigid.body->setCollisionFlags((rigid.body->getCollisionFlags() & ~btCollisionObject::CF_STATIC_OBJECT) |
                                btCollisionObject::CF_KINEMATIC_OBJECT);
  rigid.body->setActivationState(DISABLE_DEACTIVATION);
  // Re-added, because the world keeps kinematic and static bodies in separate lists.
  world.removeRigidBody(rigid.body.get());
  world.addRigidBody(rigid.body.get(), rigid.group, rigid.mask);
}

void Physics::move_held(PhysicsHandle handle, Carried carried) {
  const bool held = carried == Carried::held;
  RigidBody& rigid = world_->at(handle);
  btRigidBody& body = *rigid.body;
  world_->wake_neighbours(body);
  rigid.mask = carried == Carried::no ? rigid.mask | kKinematic : rigid.mask & ~kKinematic;
  world_->world.removeRigidBody(&body);
  world_->world.addRigidBody(&body, rigid.group, rigid.mask);
  body.setGravity(held ? btVector3(0, 0, 0) : world_->world.getGravity());
  body.forceActivationState(held ? DISABLE_DEACTIVATION : ACTIVE_TAG);
  body.setDeactivationTime(0);
}

void Physics::set_velocity(PhysicsHandle handle, const Eigen::Vector3d& velocity,
                           const Eigen::Vector3d& rotation_rate) {
  RigidBody& rigid = world_->at(handle);
  const Eigen::Vector3d arm = state(handle).T_map_body.rotation() * rigid.center;
  rigid.body->setLinearVelocity(to_bullet(Eigen::Vector3d(velocity + rotation_rate.cross(arm))));
  rigid.body->setAngularVelocity(to_bullet(rotation_rate));
}

double Physics::distance(const Placed& a, const Placed& b, double limit) const {
  const RigidBody &of_a = world_->at(a.handle), &of_b = world_->at(b.handle);
  const btTransform pose_a = shape_pose(of_a, a.T_map_body), pose_b = shape_pose(of_b, b.T_map_body);
  double nearest = limit;
  for_each_convex(*of_a.shape, pose_a, [&](const btConvexShape& one, const btTransform& T_map_one) {
    for_each_convex(*of_b.shape, pose_b, [&](const btConvexShape& other, const btTransform& T_map_other) {
      if (spheres_apart(one, T_map_one, other, T_map_other, nearest)) return;
      nearest = std::min(nearest, convex_distance(one, T_map_one, other, T_map_other, nearest));
    });
  });
  return nearest;
}

}  // namespace parhelion::simulation
