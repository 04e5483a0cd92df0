#include "server/simulation/tree_contacts.hpp"

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

int TreeContacts::add(btSolverConstraint& its, const JointTree& tree, Bodies& bodies, double warmer) {
  Row row;
  row.its = &its;
  row.a.body = its.m_solverBodyIdA;
  row.b.body = its.m_solverBodyIdB;
  row.b.is_a = false;
  for (Side* side : {&row.a, &row.b}) {
    side->link = tree.link(side->body);
    if (side->link >= 0)
      side->along = tree.about_point(side->link, moment(its, side->is_a), normal(its, side->is_a));
  }
  if (row.a.link < 0 && row.b.link < 0) return -1;
  row.given = its.m_appliedImpulse * warmer;
  for (const Side& side : {row.a, row.b}) {
    btSolverBody& body = bodies[side.body];
    body.internalApplyImpulse(normal(its, side.is_a) * body.m_invMass, turned(its, side.is_a),
                              row.given - its.m_appliedImpulse);
  }
  its.m_appliedImpulse = row.given;
  rows_.push_back(row);
  return static_cast<int>(rows_.size()) - 1;
}

double TreeContacts::prepare(const Row& row, Side& side, JointTree& tree, const Bodies& bodies) {
  const btSolverBody& body = bodies[side.body];
  if (side.link < 0)
    return normal(*row.its, side.is_a).length2() * body.m_invMass.x() +
           moment(*row.its, side.is_a).dot(turned(*row.its, side.is_a));
  side.composite = tree.composite(side.link);
  side.first = responses_.size();
  tree.respond(side.link, side.along, responses_);
  side.last = responses_.size();
  for (std::size_t i = side.first; i < side.last; ++i) {
    if (responses_[i].composite == side.composite) return side.along.dot(responses_[i].change);
  }
  return 0;
}

void TreeContacts::prepare(JointTree& tree, const Bodies& bodies) {
  responses_.clear();
  changes_.assign(static_cast<std::size_t>(tree.composites()), Vector6::Zero());
  pushes_ = changes_;
  for (Row& row : rows_) {
    row.weight = 1 / (prepare(row, row.a, tree, bodies) + prepare(row, row.b, tree, bodies));
    row.wanted = row.its->m_rhs / row.its->m_jacDiagABInv;
    row.penetration = row.its->m_rhsPenetration / row.its->m_jacDiagABInv;
    for (const Side* side : {&row.a, &row.b}) {
      if (side->link < 0) continue;
      const btSolverBody& body = bodies[side->body];
      row.wanted -= normal(*row.its, side->is_a).dot(body.m_deltaLinearVelocity) +
                    moment(*row.its, side->is_a).dot(body.m_deltaAngularVelocity);
    }
  }
}

double TreeContacts::change(const Row& row, const Side& side, const Bodies& bodies, bool pushes) const {
  const auto composite = static_cast<std::size_t>(side.composite);
  if (side.link >= 0) return side.along.dot((pushes ? pushes_ : changes_)[composite]);
  const btSolverBody& body = bodies[side.body];
  return normal(*row.its, side.is_a).dot(pushes ? body.m_pushVelocity : body.m_deltaLinearVelocity) +
         moment(*row.its, side.is_a).dot(pushes ? body.m_turnVelocity : body.m_deltaAngularVelocity);
}

void TreeContacts::apply(const Row& row, const Side& side, double impulse, Bodies& bodies, bool pushes) {
  std::vector<Vector6>& composites = pushes ? pushes_ : changes_;
  for (std::size_t i = side.first; i < side.last; ++i)
    composites[static_cast<std::size_t>(responses_[i].composite)] += responses_[i].change * impulse;
  if (side.link >= 0) return;
  btSolverBody& body = bodies[side.body];
  const btVector3 along = normal(*row.its, side.is_a) * body.m_invMass;
  if (pushes) {
    body.internalApplyPushImpulse(along, turned(*row.its, side.is_a), impulse);
  } else {
    body.internalApplyImpulse(along, turned(*row.its, side.is_a), impulse);
  }
}

double TreeContacts::solve(const Row& row, double wanted, btScalar& sum, double low, double high,
                           Bodies& bodies, bool pushes) {
  const double lacking = wanted - change(row, row.a, bodies, pushes) - change(row, row.b, bodies, pushes);
  const double before = sum;
  sum = std::clamp(before + lacking * row.weight, low, high);
  const double given = sum - before;
  apply(row, row.a, given, bodies, pushes);
  apply(row, row.b, given, bodies, pushes);
  return std::abs(given / row.weight);
}

double TreeContacts::solve(int number, Bodies& bodies) {
  const Row& row = rows_[static_cast<std::size_t>(number)];
  const btSolverConstraint& its = *row.its;
  return solve(row, row.wanted, its.m_appliedImpulse, its.m_lowerLimit, its.m_upperLimit, bodies, false);
}

double TreeContacts::push(int number, Bodies& bodies) {
  const Row& row = rows_[static_cast<std::size_t>(number)];
  if (row.penetration == 0) return 0;
  const btSolverConstraint& its = *row.its;
  return solve(row, row.penetration, its.m_appliedPushImpulse, its.m_lowerLimit, its.m_upperLimit, bodies,
               true);
}

void TreeContacts::hand_over_pushes(const JointTree& tree, Bodies& bodies, double turning) const {
  for (int i = 0; i < tree.links(); ++i) {
    const Vector6& push = pushes_[static_cast<std::size_t>(tree.composite(i))];
    btSolverBody& body = bodies[tree.body(i)];
    body.m_pushVelocity += tree.velocity_of_center(i, push, turning);
    body.m_turnVelocity += btVector3(push[0], push[1], push[2]);
  }
}

void TreeContacts::hand_over(Bodies& bodies) {
  for (Row& row : rows_) {
    const double since = row.its->m_appliedImpulse - row.given;
    row.given = row.its->m_appliedImpulse;
    for (const Side* side : {&row.a, &row.b}) {
      if (side->link < 0) continue;
      btSolverBody& body = bodies[side->body];
      body.internalApplyImpulse(normal(*row.its, side->is_a) * body.m_invMass, turned(*row.its, side->is_a),
                                since);
    }
  }
}

}  // namespace parhelion::simulation
