// The solver's iterations: joints of robots as trees, and sweeps over all rows.
#include <algorithm>
#include <bit>

#include "server/simulation/physics/physics_solver.hpp"

namespace parhelion::simulation {
namespace {

constexpr int kTreeSweeps = 30;  // maximum, where jointed parts have contacts

}  // namespace

/// Adds the joints of robots, which have no rows.
void PartSolver::plant(btTypedConstraint** constraints, int count, const btContactSolverInfo& info) {
  tree_.clear();
  tree_joints_.clear();
  for (int i = 0; i < count; ++i) {
    auto* joint = static_cast<PartJoint*>(constraints[i]);  // the only kind of constraint here
    if (joint->in_tree() && joint->isEnabled()) tree_joints_.push_back(joint);
  }
  // Parts are numbered parents first.
  std::sort(tree_joints_.begin(), tree_joints_.end(), [](const PartJoint* one, const PartJoint* other) {
    return one->getRigidBodyB().getUserIndex() < other->getRigidBodyB().getUserIndex();
  });
  const double repair = info.m_erp / info.m_timeStep;
  for (PartJoint* joint : tree_joints_) {
    const int a = getOrInitSolverBody(joint->getRigidBodyA(), info.m_timeStep);
    const int b = getOrInitSolverBody(joint->getRigidBodyB(), info.m_timeStep);
    tree_.add(*joint, joint->aim(repair), a, b, m_tmpSolverBodyPool);
  }
}

/// Finds the contacts of trees: Bullet's rows do not move in memory from here on.
btScalar PartSolver::solveGroupCacheFriendlySetup(btCollisionObject** bodies, int count,
                                                  btPersistentManifold** manifolds, int manifold_count,
                                                  btTypedConstraint** constraints, int constraint_count,
                                                  const btContactSolverInfo& info, btIDebugDraw* drawer) {
  const btScalar result = btSequentialImpulseConstraintSolver::solveGroupCacheFriendlySetup(
      bodies, count, manifolds, manifold_count, constraints, constraint_count, info, drawer);
  tree_rows_.assign(static_cast<std::size_t>(m_tmpSolverContactConstraintPool.size()), -1);
  tree_contacts_.clear();
  if (tree_.empty()) return result;
  // Bullet starts a row with m_warmstartingFactor of its last impulse; rows of trees start with all of it.
  const double warm_start_scale = 1 / info.m_warmstartingFactor;
  for (int i = 0; i < m_tmpSolverContactConstraintPool.size(); ++i)
    tree_rows_[static_cast<std::size_t>(i)] =
        tree_contacts_.add(m_tmpSolverContactConstraintPool[i], tree_, m_tmpSolverBodyPool, warm_start_scale);
  tree_frictions_.clear();
  for (int i = 0; i < m_tmpSolverContactFrictionConstraintPool.size(); ++i)
    tree_frictions_.push_back(tree_contacts_.add(m_tmpSolverContactFrictionConstraintPool[i], tree_,
                                                 m_tmpSolverBodyPool, warm_start_scale));
  tree_.solve(m_tmpSolverBodyPool);
  tree_contacts_.prepare(tree_, m_tmpSolverBodyPool);
  return result;
}

void PartSolver::solveGroupCacheFriendlySplitImpulseIterations(
    btCollisionObject** bodies, int count, btPersistentManifold** manifolds, int manifold_count,
    btTypedConstraint** constraints, int constraint_count, const btContactSolverInfo& info,
    btIDebugDraw* drawer) {
  if (tree_.empty())
    return btSequentialImpulseConstraintSolver::solveGroupCacheFriendlySplitImpulseIterations(
        bodies, count, manifolds, manifold_count, constraints, constraint_count, info, drawer);
  for (int iteration = 0; iteration < info.m_numIterations; ++iteration) {
    double changed = 0;
    for (int i = 0; i < m_tmpSolverContactConstraintPool.size(); ++i) {
      const btSolverConstraint& row = m_tmpSolverContactConstraintPool[i];
      const int number = tree_rows_[static_cast<std::size_t>(i)];
      const double change =
          number >= 0 ? tree_contacts_.push(number, m_tmpSolverBodyPool)
                      : resolveSplitPenetrationImpulse(m_tmpSolverBodyPool[row.m_solverBodyIdA],
                                                       m_tmpSolverBodyPool[row.m_solverBodyIdB], row);
      changed = std::max(changed, change * change);
    }
    if (changed <= info.m_leastSquaresResidualThreshold) break;
  }
  tree_contacts_.apply_pushes_to_bodies(tree_, m_tmpSolverBodyPool, info.m_splitImpulseTurnErp);
}

/// Applies contact impulses to the trees' parts, and updates which joints hold. Returns whether a joint
/// changed.
bool PartSolver::settle_trees() {
  tree_contacts_.apply_to_bodies(m_tmpSolverBodyPool);
  if (!tree_.solve(m_tmpSolverBodyPool)) return false;
  tree_contacts_.prepare(tree_, m_tmpSolverBodyPool);
  return true;
}

btScalar PartSolver::solveGroupCacheFriendlyIterations(btCollisionObject** bodies, int count,
                                                       btPersistentManifold** manifolds, int manifold_count,
                                                       btTypedConstraint** constraints, int constraint_count,
                                                       const btContactSolverInfo& info,
                                                       btIDebugDraw* drawer) {
  solveGroupCacheFriendlySplitImpulseIterations(bodies, count, manifolds, manifold_count, constraints,
                                                constraint_count, info, drawer);
  const bool trees = !tree_.empty();
  // A cable needs many sweeps: they depend on its length, and none is skipped.
  const bool chains = m_maxOverrideNumSolverIterations > info.m_numIterations;
  const int max_sweeps =
      std::max({info.m_numIterations, m_maxOverrideNumSolverIterations, trees ? kTreeSweeps : 0});
  bool chose = false;
  // If joints changed after the last sweep, contacts are solved again.
  for (int done = 1; done <= max_sweeps || (chose && !chains && done <= 2 * max_sweeps); ++done) {
    const bool calm = sweep() <= info.m_leastSquaresResidualThreshold;
    // Motors and limits choose early, and then less and less often.
    const bool choose =
        trees && (calm || done >= max_sweeps || std::has_single_bit(static_cast<unsigned>(done)));
    chose = choose && settle_trees();
    if (calm && !chose && !chains) break;
  }
  return 0;
}

/// Joints, then all normals, then all frictions. Returns the square of the largest change of a speed.
double PartSolver::sweep() {
  double changed = 0;
  const auto count = [&changed](double change) { changed = std::max(changed, change * change); };
  for (int i = 0; i < m_tmpSolverNonContactConstraintPool.size(); ++i) {
    const btSolverConstraint& row = m_tmpSolverNonContactConstraintPool[i];
    count(resolveSingleConstraintRowGeneric(m_tmpSolverBodyPool[row.m_solverBodyIdA],
                                            m_tmpSolverBodyPool[row.m_solverBodyIdB], row));
  }
  for (int i = 0; i < m_tmpSolverContactConstraintPool.size(); ++i) count(solve_normal(i));
  for (int i = 0; i < m_tmpSolverContactFrictionConstraintPool.size(); ++i) count(solve_friction(i));
  return changed;
}

double PartSolver::solve_normal(int contact) {
  const int number = tree_rows_[static_cast<std::size_t>(contact)];
  if (number >= 0) return tree_contacts_.solve(number, m_tmpSolverBodyPool);
  const btSolverConstraint& row = m_tmpSolverContactConstraintPool[contact];
  return resolveSingleConstraintRowLowerLimit(m_tmpSolverBodyPool[row.m_solverBodyIdA],
                                              m_tmpSolverBodyPool[row.m_solverBodyIdB], row);
}

double PartSolver::solve_friction(int friction) {
  btSolverConstraint& row = m_tmpSolverContactFrictionConstraintPool[friction];
  row.m_upperLimit = row.m_friction * m_tmpSolverContactConstraintPool[row.m_frictionIndex].m_appliedImpulse;
  row.m_lowerLimit = -row.m_upperLimit;
  if (tree_rows_[static_cast<std::size_t>(row.m_frictionIndex)] >= 0)
    return tree_contacts_.solve(tree_frictions_[static_cast<std::size_t>(friction)], m_tmpSolverBodyPool);
  return resolveSingleConstraintRowGeneric(m_tmpSolverBodyPool[row.m_solverBodyIdA],
                                           m_tmpSolverBodyPool[row.m_solverBodyIdB], row);
}

}  // namespace parhelion::simulation
