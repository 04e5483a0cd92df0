// Implementation of Physics with Bullet's types: included by physics*.cpp only.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <cassert>
#include <memory>
#include <vector>

#include "server/simulation/physics/physics.hpp"
#include "server/simulation/physics/physics_solver.hpp"

namespace parhelion::simulation {

enum PhysicsGroup : int {
  kFixed = 1,
  kFloor = 2,
  kFree = 4,
  kUpright = 8,
  kKinematic = 16,
  kRobot = 32,
  kLeaf = 64
};

inline btVector3 to_bullet(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
inline Eigen::Vector3d from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

inline btTransform to_bullet(const Eigen::Isometry3d& isometry) {
  const Eigen::Matrix3d R = isometry.linear();
  return btTransform(
      btMatrix3x3(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
      to_bullet(Eigen::Vector3d(isometry.translation())));
}

inline Eigen::Isometry3d from_bullet(const btTransform& transform) {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) isometry(row, column) = transform.getBasis()[row][column];
  }
  isometry.translation() = from_bullet(transform.getOrigin());
  return isometry;
}

std::unique_ptr<btCollisionShape> make_part_shape(const PartShape& part);

struct RigidBody {
  std::unique_ptr<btTriangleMesh> triangles;  // of a mesh shape, which references them
  std::unique_ptr<btCollisionShape> shape;
  std::vector<std::unique_ptr<btCollisionShape>> children;  // of a compound, which references them
  std::unique_ptr<btRigidBody> body;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // of mass, in the body's frame
  PhysicsGroup group = kFixed;
  int mask = 0;
  bool suspended = false;
  std::unique_ptr<PartSurfaces> part;  // of a robot's part: surface properties of its shapes...
  Eigen::Isometry3d T_body_inertial = Eigen::Isometry3d::Identity();  // ...and its principal axes
};

/// Filters the broadphase's pairs: parts of one robot do not collide with each other.
struct PairFilter : btOverlapFilterCallback {
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    if (!(a->m_collisionFilterGroup & b->m_collisionFilterMask) ||
        !(b->m_collisionFilterGroup & a->m_collisionFilterMask))
      return false;
    const PartSurfaces* part = part_of(static_cast<btCollisionObject*>(a->m_clientObject));
    const PartSurfaces* other = part_of(static_cast<btCollisionObject*>(b->m_clientObject));
    return !part || !other || part->robot != other->robot;
  }
};

/// Bullet's world without prediction of poses: no body is fast enough to tunnel through another within a
/// step, and the prediction is as expensive as the motion.
struct StepWorld : btDiscreteDynamicsWorld {
  using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;

 protected:
  void predictUnconstraintMotion(btScalar step) override {
    for (int i = 0; i < m_nonStaticRigidBodies.size(); ++i) {
      btRigidBody& body = *m_nonStaticRigidBodies[i];
      if (!body.isStaticOrKinematicObject()) body.applyDamping(step);
    }
  }
  void createPredictiveContacts(btScalar) override {}
};

struct Physics::World {
  World(double step_s, int joint_sweeps);
  ~World();

  PhysicsHandle add(std::unique_ptr<btCollisionShape> shape, double mass, const Eigen::Isometry3d& pose,
                    const Eigen::Vector3d& center, PhysicsGroup group, int mask,
                    std::unique_ptr<PartSurfaces> part = {});
  PhysicsHandle add_free(std::unique_ptr<btCollisionShape> shape, double mass, const Eigen::Vector3d& center,
                         const Transform<Map, Body>& T_map_body);
  void make_kinematic(PhysicsHandle handle);
  /// Wakes neighbours of a removed body, which might otherwise sleep in the air.
  void wake_neighbours(const btRigidBody& body);
  RigidBody& at(PhysicsHandle handle) {
    assert(handle >= 0 && handle < static_cast<int>(bodies.size()) &&
           bodies[static_cast<std::size_t>(handle)].body);
    return bodies[static_cast<std::size_t>(handle)];
  }
  PartJoint& joint(JointHandle handle) {
    assert(handle >= 0 && handle < static_cast<int>(joints.size()) &&
           joints[static_cast<std::size_t>(handle)]);
    return *joints[static_cast<std::size_t>(handle)];
  }
  /// Finds contacts of bodies placed since the last step before they sleep on: Bullet wakes bodies by
  /// proximity after its contact search, and a body without contacts would fall for a step.
  void settle();
  void meet_neighbours(btRigidBody& body);
  void collect_contacts();
  /// Invalidates joint positions, to be measured at the next query.
  void forget_joint_positions();
  /// Collects the contacts of rolling surfaces in the newest step.
  void collect_runners();

  double step;
  int sweeps;  // over joints of robots; 0: exact solution
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher;
  PairFilter filter;
  btDbvtBroadphase broadphase;
  PartSolver solver;
  StepWorld world;
  std::vector<RigidBody> bodies;                   // by handle
  std::vector<std::unique_ptr<PartJoint>> joints;  // by handle
  std::vector<PhysicsContact> contacts;
  std::vector<PhysicsHandle> put_down;  // placed since the last step, at rest
};

}  // namespace parhelion::simulation
