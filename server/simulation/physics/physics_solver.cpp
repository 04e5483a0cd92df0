#include "server/simulation/physics/physics_solver.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::simulation {
namespace {

constexpr double kSide = 0.3;  // sine of the angle to its axle below which a contact is on a wheel's side
constexpr double kWarmStart = 0.9;  // fraction of the last step's impulses used as a joint's start value
constexpr double kCreep = 0.01;     // m/s of slip below which static friction applies
constexpr int kTwoDirections = SOLVER_USE_2_FRICTION_DIRECTIONS | SOLVER_ENABLE_FRICTION_DIRECTION_CACHING;

struct Side {
  PartSurfaces* part = nullptr;
  PartSurfaces::Surface surface;
  Runner* runner = nullptr;
  btVector3 rolling{0, 0, 0};  // unit: direction of the surface point's motion when rolling forward
};

/// `outward`: the contact's normal, out of this body.
Side side_of(const btCollisionObject* object, int index, const btVector3& outward) {
  Side side;
  side.part = part_of(object);
  if (!side.part) return side;
  const auto last = static_cast<int>(side.part->shapes.size()) - 1;
  side.surface = side.part->shapes[static_cast<std::size_t>(std::clamp(index, 0, last))];
  if (side.surface.runner < 0) return side;
  Runner& runner = side.part->runners[static_cast<std::size_t>(side.surface.runner)];
  // A point of a surface rolling about `axis` moves along axis x normal.
  const btVector3 axis = object->getWorldTransform().getBasis() * runner.axis;
  const btVector3 along = axis.cross(outward);
  const double length = along.length();
  if (length < kSide) return side;
  side.runner = &runner;
  side.rolling = along / length;
  return side;
}

/// Sets a contact point's friction, and its target motion if a runner is involved.
void prepare(btManifoldPoint& point, const btCollisionObject* a, const btCollisionObject* b) {
  const Side first = side_of(a, point.m_index0, -point.m_normalWorldOnB);
  const Side second = side_of(b, point.m_index1, point.m_normalWorldOnB);
  const auto friction = [](const Side& side) {
    return side.runner ? side.runner->friction : side.surface.friction;
  };
  point.m_combinedFriction = first.part && second.part ? std::min(friction(first), friction(second))
                             : first.part              ? friction(first)
                                                       : friction(second);
  point.m_contactPointFlags &= ~(kRollingPoint | BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED);
  if (!first.runner && !second.runner) {
    if (a->isStaticOrKinematicObject() || b->isStaticOrKinematicObject()) return;
    // Directions independent of small slip: a gripped object does not creep.
    btPlaneSpace1(point.m_normalWorldOnB, point.m_lateralFrictionDir1, point.m_lateralFrictionDir2);
    point.m_contactMotion1 = point.m_contactMotion2 = 0;
    point.m_contactPointFlags |= BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
    return;
  }
  point.m_contactPointFlags |= kRollingPoint | BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
  point.m_lateralFrictionDir1 = first.runner ? first.rolling : second.rolling;
  point.m_lateralFrictionDir2 = point.m_lateralFrictionDir1.cross(point.m_normalWorldOnB);
  // No slip: v_a + s_a t_a = v_b + s_b t_b; the solver uses the target of (v_a - v_b) along each direction.
  btVector3 motion(0, 0, 0);
  if (first.runner) motion -= first.runner->speed * first.rolling;
  if (second.runner) motion += second.runner->speed * second.rolling;
  point.m_contactMotion1 = motion.dot(point.m_lateralFrictionDir1);
  point.m_contactMotion2 = motion.dot(point.m_lateralFrictionDir2);
}

btScalar relative_velocity(const btSolverConstraint& row, const btSolverBody& a, const btSolverBody& b) {
  const auto along = [](const btSolverBody& body, const btVector3& linear, const btVector3& angular) {
    if (!body.m_originalBody) return btScalar(0);
    return linear.dot(body.m_linearVelocity + body.m_externalForceImpulse + body.m_deltaLinearVelocity) +
           angular.dot(body.m_angularVelocity + body.m_externalTorqueImpulse + body.m_deltaAngularVelocity);
  };
  return along(a, row.m_contactNormal1, row.m_relpos1CrossNormal) +
         along(b, row.m_contactNormal2, row.m_relpos2CrossNormal);
}

/// m/s along a row, before solving.
btScalar velocity_before(const btSolverConstraint& row, const btSolverBody& a, const btSolverBody& b) {
  btScalar velocity = 0;
  if (a.m_originalBody)
    velocity +=
        row.m_contactNormal1.dot(a.m_linearVelocity) + row.m_relpos1CrossNormal.dot(a.m_angularVelocity);
  if (b.m_originalBody)
    velocity +=
        row.m_contactNormal2.dot(b.m_linearVelocity) + row.m_relpos2CrossNormal.dot(b.m_angularVelocity);
  return velocity;
}

PartJoint* joint_of(const btSolverConstraint& row) {
  auto* constraint = static_cast<btTypedConstraint*>(row.m_originalContactPoint);
  return constraint->getUserConstraintType() == PartJoint::kUserType ? static_cast<PartJoint*>(constraint)
                                                                     : nullptr;
}

/// Runners of a contact row's two sides (if the point is on a rolling surface).
struct RowRunners {
  Runner* a = nullptr;
  Runner* b = nullptr;
};

RowRunners runners_of(const btSolverConstraint& row, const btSolverBody& a, const btSolverBody& b) {
  const auto& point = *static_cast<const btManifoldPoint*>(row.m_originalContactPoint);
  if (!(point.m_contactPointFlags & kRollingPoint)) return {};
  const auto find = [](const btSolverBody& body, int index) -> Runner* {
    PartSurfaces* part = body.m_originalBody ? part_of(body.m_originalBody) : nullptr;
    if (!part) return nullptr;
    const auto last = static_cast<int>(part->shapes.size()) - 1;
    const int runner = part->shapes[static_cast<std::size_t>(std::clamp(index, 0, last))].runner;
    return runner < 0 ? nullptr : &part->runners[static_cast<std::size_t>(runner)];
  };
  return {find(a, point.m_index0), find(b, point.m_index1)};
}

}  // namespace

void PartSolver::convertContacts(btPersistentManifold** manifolds, int count,
                                 const btContactSolverInfo& info) {
  // Robots' contacts have friction along and across the rolling direction; contacts without a robot are
  // solved as in a world without robots.
  btContactSolverInfo plain = info;
  plain.m_solverMode &= ~kTwoDirections;
  for (int i = 0; i < count; ++i) {
    btPersistentManifold& manifold = *manifolds[i];
    if (!part_of(manifold.getBody0()) && !part_of(manifold.getBody1())) {
      convertContact(&manifold, plain);
      continue;
    }
    for (int p = 0; p < manifold.getNumContacts(); ++p)
      prepare(manifold.getContactPoint(p), manifold.getBody0(), manifold.getBody1());
    const int first = m_tmpSolverContactConstraintPool.size();
    convertContact(&manifold, info);
    limit_motors(first, m_tmpSolverContactConstraintPool.size());
  }
  // Bullet reads a second direction's impulse of each contact, even if it has only one direction.
  m_tmpSolverContactFrictionConstraintPool.reserve(m_tmpSolverContactFrictionConstraintPool.size() + 1);
}

/// Limits friction along the rolling direction by the motor's force, divided by the load of the previous
/// step.
void PartSolver::limit_motors(int first_contact, int last_contact) {
  for (int i = first_contact; i < last_contact; ++i) {
    const btSolverConstraint& row = m_tmpSolverContactConstraintPool[i];
    const btSolverBody& a = m_tmpSolverBodyPool[row.m_solverBodyIdA];
    const btSolverBody& b = m_tmpSolverBodyPool[row.m_solverBodyIdB];
    const RowRunners runners = runners_of(row, a, b);
    if (!runners.a && !runners.b) continue;
    // Coulomb friction opposes the slip: a surface sliding in one direction has little friction left in the
    // other, which is how skid-steered robots turn.
    const auto& point = *static_cast<const btManifoldPoint*>(row.m_originalContactPoint);
    btSolverConstraint& friction = m_tmpSolverContactFrictionConstraintPool[row.m_frictionIndex];
    btSolverConstraint& across = m_tmpSolverContactFrictionConstraintPool[row.m_frictionIndex + 1];
    const double slip_along = std::abs(velocity_before(friction, a, b) - point.m_contactMotion1);
    const double slip_across = std::abs(velocity_before(across, a, b) - point.m_contactMotion2);
    const double slip = std::hypot(slip_along, slip_across) + kCreep;
    friction.m_friction *= (slip_along + kCreep) / slip;
    across.m_friction *= (slip_across + kCreep) / slip;
    for (Runner* runner : {runners.a, runners.b}) {
      if (!runner || !(runner->normal_force > 0)) continue;
      runner->held_by_motor = runner->max_force < friction.m_friction * runner->normal_force;
      friction.m_friction = std::min(friction.m_friction, runner->max_force / runner->normal_force);
    }
  }
}

void PartSolver::convertJoints(btTypedConstraint** constraints, int count, const btContactSolverInfo& info) {
  btSequentialImpulseConstraintSolver::convertJoints(constraints, count, info);
  plant(constraints, count, info);
  int number = 0;
  for (int i = 0; i < m_tmpSolverNonContactConstraintPool.size(); ++i) {
    btSolverConstraint& row = m_tmpSolverNonContactConstraintPool[i];
    const bool first = i == 0 || m_tmpSolverNonContactConstraintPool[i - 1].m_originalContactPoint !=
                                     row.m_originalContactPoint;
    number = first ? 0 : number + 1;
    const PartJoint* joint = joint_of(row);
    if (!joint) continue;
    row.m_appliedImpulse = std::clamp(kWarmStart * joint->impulses[static_cast<std::size_t>(number)],
                                      row.m_lowerLimit, row.m_upperLimit);
    btSolverBody& a = m_tmpSolverBodyPool[row.m_solverBodyIdA];
    btSolverBody& b = m_tmpSolverBodyPool[row.m_solverBodyIdB];
    a.internalApplyImpulse(row.m_contactNormal1 * a.internalGetInvMass(), row.m_angularComponentA,
                           row.m_appliedImpulse);
    b.internalApplyImpulse(row.m_contactNormal2 * b.internalGetInvMass(), row.m_angularComponentB,
                           row.m_appliedImpulse);
  }
}

btScalar PartSolver::solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                                   const btContactSolverInfo& info) {
  tree_.finish();
  int number = 0;
  for (int i = 0; i < m_tmpSolverNonContactConstraintPool.size(); ++i) {
    const btSolverConstraint& row = m_tmpSolverNonContactConstraintPool[i];
    const bool first = i == 0 || m_tmpSolverNonContactConstraintPool[i - 1].m_originalContactPoint !=
                                     row.m_originalContactPoint;
    number = first ? 0 : number + 1;
    if (PartJoint* joint = joint_of(row))
      joint->impulses[static_cast<std::size_t>(number)] = row.m_appliedImpulse;
  }
  for (int i = 0; i < m_tmpSolverContactConstraintPool.size(); ++i) {
    const btSolverConstraint& row = m_tmpSolverContactConstraintPool[i];
    const btSolverBody& a = m_tmpSolverBodyPool[row.m_solverBodyIdA];
    const btSolverBody& b = m_tmpSolverBodyPool[row.m_solverBodyIdB];
    const RowRunners runners = runners_of(row, a, b);
    if (!runners.a && !runners.b) continue;
    const btSolverConstraint& friction = m_tmpSolverContactFrictionConstraintPool[row.m_frictionIndex];
    const double moved = relative_velocity(friction, a, b);
    const double motor = friction.m_friction;
    if (runners.a) runners.a->meet(row.m_appliedImpulse, -friction.m_appliedImpulse, -moved, motor);
    if (runners.b) runners.b->meet(row.m_appliedImpulse, friction.m_appliedImpulse, moved, motor);
  }
  return btSequentialImpulseConstraintSolver::solveGroupCacheFriendlyFinish(bodies, count, info);
}

}  // namespace parhelion::simulation
