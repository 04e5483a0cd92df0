#include "server/simulation/physics/tree_contacts.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::simulation {
namespace {

const btVector3& normal(const btSolverConstraint& row, bool is_a) {
  return is_a ? row.m_contactNormal1 : row.m_contactNormal2;
}

const btVector3& moment(const btSolverConstraint& row, bool is_a) {
  return is_a ? row.m_relpos1CrossNormal : row.m_relpos2CrossNormal;
}

const btVector3& turned(const btSolverConstraint& row, bool is_a) {
  return is_a ? row.m_angularComponentA : row.m_angularComponentB;
}

}  // namespace

TreeContacts::TreeContacts() {
  // Enough for a dozen robots in contact, so that steps do not allocate.
  rows_.reserve(1024);
  responses_.reserve(4096);
}

void TreeContacts::clear() { rows_.clear(); }

int TreeContacts::add(btSolverConstraint& constraint, const JointTree& tree, Bodies& bodies,
                      double warm_start_scale) {
  Row row;
  row.constraint = &constraint;
  row.a.body = constraint.m_solverBodyIdA;
  row.b.body = constraint.m_solverBodyIdB;
  row.b.is_a = false;
  for (Side* side : {&row.a, &row.b}) {
    side->link = tree.link(side->body);
    if (side->link >= 0)
      side->unit_impulse =
          tree.about_point(side->link, moment(constraint, side->is_a), normal(constraint, side->is_a));
  }
  if (row.a.link < 0 && row.b.link < 0) return -1;
  row.applied_impulse = constraint.m_appliedImpulse * warm_start_scale;
  for (const Side& side : {row.a, row.b}) {
    btSolverBody& body = bodies[side.body];
    body.internalApplyImpulse(normal(constraint, side.is_a) * body.m_invMass, turned(constraint, side.is_a),
                              row.applied_impulse - constraint.m_appliedImpulse);
  }
  constraint.m_appliedImpulse = row.applied_impulse;
  rows_.push_back(row);
  return static_cast<int>(rows_.size()) - 1;
}

double TreeContacts::prepare(const Row& row, Side& side, JointTree& tree, const Bodies& bodies) {
  const btSolverBody& body = bodies[side.body];
  if (side.link < 0)
    return normal(*row.constraint, side.is_a).length2() * body.m_invMass.x() +
           moment(*row.constraint, side.is_a).dot(turned(*row.constraint, side.is_a));
  side.composite = tree.composite(side.link);
  side.first = responses_.size();
  tree.respond(side.link, side.unit_impulse, responses_);
  side.last = responses_.size();
  for (std::size_t i = side.first; i < side.last; ++i) {
    if (responses_[i].composite == side.composite) return side.unit_impulse.dot(responses_[i].change);
  }
  return 0;
}

void TreeContacts::prepare(JointTree& tree, const Bodies& bodies) {
  responses_.clear();
  changes_.assign(static_cast<std::size_t>(tree.composites()), Vector6::Zero());
  pushes_ = changes_;
  for (Row& row : rows_) {
    row.weight = 1 / (prepare(row, row.a, tree, bodies) + prepare(row, row.b, tree, bodies));
    row.target_change = row.constraint->m_rhs / row.constraint->m_jacDiagABInv;
    row.penetration = row.constraint->m_rhsPenetration / row.constraint->m_jacDiagABInv;
    for (const Side* side : {&row.a, &row.b}) {
      if (side->link < 0) continue;
      const btSolverBody& body = bodies[side->body];
      row.target_change -= normal(*row.constraint, side->is_a).dot(body.m_deltaLinearVelocity) +
                           moment(*row.constraint, side->is_a).dot(body.m_deltaAngularVelocity);
    }
  }
}

double TreeContacts::change(const Row& row, const Side& side, const Bodies& bodies, bool pushes) const {
  const auto composite = static_cast<std::size_t>(side.composite);
  if (side.link >= 0) return side.unit_impulse.dot((pushes ? pushes_ : changes_)[composite]);
  const btSolverBody& body = bodies[side.body];
  return normal(*row.constraint, side.is_a).dot(pushes ? body.m_pushVelocity : body.m_deltaLinearVelocity) +
         moment(*row.constraint, side.is_a).dot(pushes ? body.m_turnVelocity : body.m_deltaAngularVelocity);
}

void TreeContacts::apply(const Row& row, const Side& side, double impulse, Bodies& bodies, bool pushes) {
  std::vector<Vector6>& composites = pushes ? pushes_ : changes_;
  for (std::size_t i = side.first; i < side.last; ++i)
    composites[static_cast<std::size_t>(responses_[i].composite)] += responses_[i].change * impulse;
  if (side.link >= 0) return;
  btSolverBody& body = bodies[side.body];
  const btVector3 linear_component = normal(*row.constraint, side.is_a) * body.m_invMass;
  if (pushes) {
    body.internalApplyPushImpulse(linear_component, turned(*row.constraint, side.is_a), impulse);
  } else {
    body.internalApplyImpulse(linear_component, turned(*row.constraint, side.is_a), impulse);
  }
}

double TreeContacts::solve(const Row& row, double target, btScalar& sum, double low, double high,
                           Bodies& bodies, bool pushes) {
  const double lacking = target - change(row, row.a, bodies, pushes) - change(row, row.b, bodies, pushes);
  const double before = sum;
  sum = std::clamp(before + lacking * row.weight, low, high);
  const double impulse = sum - before;
  apply(row, row.a, impulse, bodies, pushes);
  apply(row, row.b, impulse, bodies, pushes);
  return std::abs(impulse / row.weight);
}

double TreeContacts::solve(int number, Bodies& bodies) {
  const Row& row = rows_[static_cast<std::size_t>(number)];
  const btSolverConstraint& constraint = *row.constraint;
  return solve(row, row.target_change, constraint.m_appliedImpulse, constraint.m_lowerLimit,
               constraint.m_upperLimit, bodies, false);
}

double TreeContacts::push(int number, Bodies& bodies) {
  const Row& row = rows_[static_cast<std::size_t>(number)];
  if (row.penetration == 0) return 0;
  const btSolverConstraint& constraint = *row.constraint;
  return solve(row, row.penetration, constraint.m_appliedPushImpulse, constraint.m_lowerLimit,
               constraint.m_upperLimit, bodies, true);
}

void TreeContacts::apply_pushes_to_bodies(const JointTree& tree, Bodies& bodies, double turning) const {
  for (int i = 0; i < tree.links(); ++i) {
    const Vector6& push = pushes_[static_cast<std::size_t>(tree.composite(i))];
    btSolverBody& body = bodies[tree.body(i)];
    body.m_pushVelocity += tree.velocity_of_center(i, push, turning);
    body.m_turnVelocity += btVector3(push[0], push[1], push[2]);
  }
}

void TreeContacts::apply_to_bodies(Bodies& bodies) {
  for (Row& row : rows_) {
    const double since = row.constraint->m_appliedImpulse - row.applied_impulse;
    row.applied_impulse = row.constraint->m_appliedImpulse;
    for (const Side* side : {&row.a, &row.b}) {
      if (side->link < 0) continue;
      btSolverBody& body = bodies[side->body];
      body.internalApplyImpulse(normal(*row.constraint, side->is_a) * body.m_invMass,
                                turned(*row.constraint, side->is_a), since);
    }
  }
}

}  // namespace parhelion::simulation
