#include "server/simulation/physics/joint_tree.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>

#include "server/simulation/physics/physics_solver.hpp"

namespace parhelion::simulation {
namespace {

constexpr int kMaxChanges = 6;    // of treads in one solution
constexpr double kSlack = 1e-12;  // N s and m/s, tolerance of a tread's bound
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Eigen::Vector3d vector(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// About a point at -arm from the centre of mass.
Eigen::Matrix<double, 6, 6> inertia_about(const btRigidBody& body, const btVector3& arm) {
  Eigen::Matrix3d R;
  const btMatrix3x3& basis = body.getWorldTransform().getBasis();
  for (int row = 0; row < 3; ++row) R.row(row) = vector(basis[row]).transpose();
  const Eigen::Vector3d moments = vector(body.getInvInertiaDiagLocal()).cwiseInverse();
  const double mass = 1 / body.getInvMass();
  const Eigen::Matrix3d c = cross_matrix(vector(arm));
  Eigen::Matrix<double, 6, 6> inertia;
  inertia.topLeftCorner<3, 3>() = R * moments.asDiagonal() * R.transpose() - mass * c * c;
  inertia.topRightCorner<3, 3>() = mass * c;
  inertia.bottomLeftCorner<3, 3>() = -mass * c;
  inertia.bottomRightCorner<3, 3>() = mass * Eigen::Matrix3d::Identity();
  return inertia;
}

/// The motor pushes into the limit.
bool against_limit(const JointAim& aim) {
  return aim.limited && (aim.is_lower ? aim.speed < aim.limit_speed : aim.speed > aim.limit_speed);
}

/// The motor's part of the impulse along a joint's axis: its maximum when it pushes into its limit.
double motor_fraction(const JointAim& aim, double along) {
  if (against_limit(aim)) return aim.is_lower ? -aim.max_impulse : aim.max_impulse;
  return std::clamp(along, -aim.max_impulse, aim.max_impulse);
}

}  // namespace

void JointTree::clear() {
  links_.clear();
  joints_.clear();
  composites_.clear();
  link_by_body_.clear();
  articulated_ = false;
}

int JointTree::link(int body) const {
  const auto place = static_cast<std::size_t>(body);
  return place < link_by_body_.size() ? link_by_body_[place] : -1;
}

/// Link of a body; adds a new one as a root, or below `parent`.
int JointTree::link_of(int body, const btAlignedObjectArray<btSolverBody>& pool, int parent) {
  if (const int known = link(body); parent < 0 && known >= 0) return known;
  const btRigidBody& rigid = *pool[body].m_originalBody;
  const int number = static_cast<int>(links_.size());
  Link link;
  link.body = body;
  link.root = parent < 0 ? number : links_[static_cast<std::size_t>(parent)].root;
  link.point = parent < 0 ? rigid.getCenterOfMassPosition() : links_[static_cast<std::size_t>(parent)].point;
  link.arm = rigid.getCenterOfMassPosition() - link.point;
  link.inertia = link.articulated = inertia_about(rigid, link.arm);
  link.bias.setZero();
  link.change.setZero();
  links_.push_back(link);
  if (link_by_body_.size() <= static_cast<std::size_t>(body))
    link_by_body_.resize(static_cast<std::size_t>(body) + 1, -1);
  link_by_body_[static_cast<std::size_t>(body)] = number;
  return number;
}

/// The possible impulses of a joint's motor and limit, largest first.
void JointTree::lay_treads(Joint& joint) {
  const JointAim& aim = joint.aim;
  const auto lay = [&joint](bool holds, double speed, double low, double high) {
    joint.treads[joint.count++] = {holds, speed, low, high};
  };
  const auto give = [&](double impulse) { lay(false, 0, impulse, impulse); };
  const bool motor = aim.max_impulse > 0;
  const bool against = against_limit(aim);
  if (aim.limited && aim.is_lower) {
    lay(true, aim.limit_speed, against || !motor ? -aim.max_impulse : aim.max_impulse, kInfinity);
  }
  if (!(against && aim.is_lower) && motor) give(aim.max_impulse);
  if (!against && motor) {
    joint.tread = joint.count;
    lay(true, aim.speed, -aim.max_impulse, aim.max_impulse);
  }
  if (!(against && !aim.is_lower) || !motor) give(-aim.max_impulse);
  if (!motor) joint.tread = aim.limited && aim.is_lower ? 1 : 0;
  if (aim.limited && !aim.is_lower) {
    if (against && motor) joint.tread = joint.count;
    lay(true, aim.limit_speed, -kInfinity, against || !motor ? aim.max_impulse : -aim.max_impulse);
  }
}

void JointTree::add(PartJoint& joint, const JointAim& aim, int a, int b,
                    const btAlignedObjectArray<btSolverBody>& pool) {
  Joint its;
  its.joint = &joint;
  its.aim = aim;
  its.parent = link_of(a, pool, -1);
  its.child = link_of(b, pool, its.parent);
  const btVector3 arm = aim.point - links_[static_cast<std::size_t>(its.parent)].point;
  const auto at_point = [&](const btVector3& turn, const btVector3& shift) {
    Vector6 v;
    v << vector(turn), vector(shift + arm.cross(turn));
    return v;
  };
  const btVector3 none(0, 0, 0);
  its.axis = aim.slides ? at_point(none, aim.axis) : at_point(aim.axis, none);
  its.target = at_point(aim.turn, aim.shift);
  for (Vector6* v : {&its.lacks, &its.response, &its.passed, &its.impulse, &its.step}) v->setZero();
  lay_treads(its);
  joints_.push_back(its);
}

JointTree::Vector6 JointTree::velocity(const Link& link,
                                       const btAlignedObjectArray<btSolverBody>& pool) const {
  const btSolverBody& body = pool[link.body];
  const btVector3 turn = body.m_angularVelocity + body.m_externalTorqueImpulse + body.m_deltaAngularVelocity;
  const btVector3 center = body.m_linearVelocity + body.m_externalForceImpulse + body.m_deltaLinearVelocity;
  Vector6 v;
  v << vector(turn), vector(center + link.arm.cross(turn));
  return v;
}

/// Articulated inertia of each part with its subtree.
void JointTree::articulate() {
  articulated_ = true;
  for (Link& link : links_) link.articulated = link.inertia;
  for (std::size_t i = joints_.size(); i-- > 0;) {
    Joint& joint = joints_[i];
    const Matrix6& child = links_[static_cast<std::size_t>(joint.child)].articulated;
    Matrix6& parent = links_[static_cast<std::size_t>(joint.parent)].articulated;
    parent += child;
    if (joint.treads[joint.tread].holds) continue;
    joint.response = child * joint.axis;
    joint.compliance = 1 / joint.axis.dot(joint.response);
    parent -= joint.response * (joint.compliance * joint.response).transpose();
  }
  root_compliance_.resize(links_.size());
  for (std::size_t i = 0; i < links_.size(); ++i) {
    if (links_[i].root == static_cast<int>(i))
      root_compliance_[i] = links_[i].articulated.llt().solve(Matrix6::Identity());
  }
  compose();
}

/// A pass to the roots, collecting forces, and back: impulses and changes of velocity.
void JointTree::pass() {
  for (Link& link : links_) link.bias.setZero();
  for (std::size_t i = joints_.size(); i-- > 0;) {
    Joint& joint = joints_[i];
    const Link& child = links_[static_cast<std::size_t>(joint.child)];
    const Tread& tread = joint.treads[joint.tread];
    joint.passed = joint.lacks;
    if (tread.holds) joint.passed += joint.axis * tread.speed;
    Vector6 bias = child.bias + child.articulated * joint.passed;
    if (!tread.holds) {
      const double lacking = tread.low - joint.axis.dot(joint.impulse) - joint.axis.dot(bias);
      joint.gives = lacking * joint.compliance;
      bias += joint.response * joint.gives;
    }
    links_[static_cast<std::size_t>(joint.parent)].bias += bias;
  }
  for (std::size_t i = 0; i < links_.size(); ++i) {
    if (links_[i].root == static_cast<int>(i)) links_[i].change = -(root_compliance_[i] * links_[i].bias);
  }
  for (Joint& joint : joints_) {
    const Link& parent = links_[static_cast<std::size_t>(joint.parent)];
    Link& child = links_[static_cast<std::size_t>(joint.child)];
    child.change = parent.change + joint.passed;
    if (!joint.treads[joint.tread].holds) {
      joint.gives -= joint.compliance * joint.response.dot(parent.change);
      child.change += joint.axis * joint.gives;
    }
    joint.step = child.articulated * child.change + child.bias;
  }
}

/// Moves to the next tread where an impulse or a speed is beyond its tread.
bool JointTree::change_treads() {
  bool changed = false;
  for (Joint& joint : joints_) {
    const Tread& tread = joint.treads[joint.tread];
    std::size_t next = joint.tread;
    if (tread.holds) {
      const double impulse = joint.axis.dot(joint.impulse + joint.step);
      if (impulse > tread.high + kSlack && joint.tread > 0) --next;
      if (impulse < tread.low - kSlack && joint.tread + 1 < joint.count) ++next;
    } else {
      if (joint.tread > 0 && joint.gives < joint.treads[joint.tread - 1].speed - kSlack) --next;
      if (joint.tread + 1 < joint.count && joint.gives > joint.treads[joint.tread + 1].speed + kSlack) ++next;
    }
    changed = changed || next != joint.tread;
    joint.tread = next;
  }
  if (changed) articulated_ = false;
  return changed;
}

bool JointTree::solve(btAlignedObjectArray<btSolverBody>& pool) {
  bool chose = false;
  for (Link& link : links_) link.change = velocity(link, pool);
  for (Joint& joint : joints_)
    joint.lacks = joint.target - (links_[static_cast<std::size_t>(joint.child)].change -
                                  links_[static_cast<std::size_t>(joint.parent)].change);
  for (int change = 0; change < kMaxChanges; ++change) {
    if (!articulated_) articulate();
    pass();
    if (!change_treads()) break;
    chose = true;
  }
  if (!articulated_) articulate();
  for (Joint& joint : joints_) joint.impulse += joint.step;
  for (const Link& link : links_) {
    btSolverBody& body = pool[link.body];
    const btVector3 turn(link.change[0], link.change[1], link.change[2]);
    body.m_deltaAngularVelocity += turn;
    body.m_deltaLinearVelocity +=
        btVector3(link.change[3], link.change[4], link.change[5]) + turn.cross(link.arm);
  }
  return chose;
}

void JointTree::finish() const {
  for (const Joint& joint : joints_) {
    const btVector3 arm = joint.aim.point - links_[static_cast<std::size_t>(joint.parent)].point;
    JointImpulse impulse;
    impulse.force = {joint.impulse[3], joint.impulse[4], joint.impulse[5]};
    impulse.moment =
        btVector3(joint.impulse[0], joint.impulse[1], joint.impulse[2]) - arm.cross(impulse.force);
    const double along = joint.axis.dot(joint.impulse);
    impulse.limit = along - motor_fraction(joint.aim, along);
    joint.joint->bore(impulse);
  }
}

}  // namespace parhelion::simulation
