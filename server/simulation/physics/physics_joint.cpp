#include <algorithm>
#include <cmath>

#include "server/simulation/physics/physics_world.hpp"

namespace parhelion::simulation {
namespace {

constexpr int kIterations = 30;   // of the solver, for a cable: enough for a long chain to converge
constexpr double kRepair = 0.25;  // fraction of Bullet's rate of position correction: at the full rate long
                                  // arms oscillate
constexpr double kLimitReach = 0.05;  // rad or m from a limit within which it is active
constexpr double kLimitRepair = 0.2;  // fraction of a limit's overshoot corrected per step

}  // namespace

PartJoint::PartJoint(const JointDefinition& definition, btRigidBody& a, btRigidBody& b,
                     const Eigen::Isometry3d& T_a_inertial, const Eigen::Isometry3d& T_b_inertial,
                     double step_s, bool in_tree)
    : btTypedConstraint(D6_CONSTRAINT_TYPE, a, b),
      step(step_s),
      in_tree_(in_tree),
      prismatic_(definition.kind == PartJointKind::prismatic),
      ball_(definition.kind == PartJointKind::ball),
      limited_(definition.limited),
      lower_(definition.lower),
      upper_(definition.upper),
      T_a_(to_bullet(T_a_inertial.inverse(Eigen::Isometry) * definition.T_a_joint)),
      T_b_(to_bullet(T_b_inertial.inverse(Eigen::Isometry) * definition.T_b_joint)) {
  setUserConstraintType(kUserType);
  if (ball_) setOverrideNumSolverIterations(kIterations);
}

void PartJoint::measure() {
  if (measured_) return;
  measured_ = true;
  const btTransform a = m_rbA.getWorldTransform() * T_a_, b = m_rbB.getWorldTransform() * T_b_;
  const btVector3 axis = a.getBasis().getColumn(0);
  if (prismatic_) {
    position_ = (b.getOrigin() - a.getOrigin()).dot(axis);
    const btVector3 arm_a = b.getOrigin() - m_rbA.getCenterOfMassPosition();
    const btVector3 arm_b = b.getOrigin() - m_rbB.getCenterOfMassPosition();
    velocity_ = (m_rbB.getVelocityInLocalPoint(arm_b) - m_rbA.getVelocityInLocalPoint(arm_a)).dot(axis);
    return;
  }
  const btVector3 y = b.getBasis().getColumn(1);
  const double angle = std::atan2(y.dot(a.getBasis().getColumn(2)), y.dot(a.getBasis().getColumn(1)));
  position_ += std::remainder(angle - position_, 2 * SIMD_PI);
  velocity_ = (m_rbB.getAngularVelocity() - m_rbA.getAngularVelocity()).dot(axis);
}

void PartJoint::restart(double position) {
  position_ = position;
  velocity_ = 0;
  moved();
  impulses = {};
  rows = 0;
}

double PartJoint::effort() const { return ball_ || !isEnabled() ? 0 : impulses[5] / step; }

double PartJoint::load() const {
  if (!isEnabled()) return 0;
  const double along = impulses[5] + impulses[6];
  const double u = prismatic_ ? impulses[0] : impulses[3], v = prismatic_ ? impulses[1] : impulses[4];
  return std::sqrt(u * u + v * v + along * along) / step;
}

double PartJoint::pull() const {
  if (!isEnabled() || prismatic_) return 0;
  return std::hypot(impulses[0], impulses[1], impulses[2]) / step;
}

bool PartJoint::near_limit() const {
  return limited_ && !ball_ && (position_ < lower_ + kLimitReach || position_ > upper_ - kLimitReach);
}

/// A limit is reached within the step, not after it; an overshoot is corrected softly.
double PartJoint::limit_speed(bool& is_lower) const {
  is_lower = position_ - lower_ < upper_ - position_;
  const double to_limit = is_lower ? lower_ - position_ : upper_ - position_;
  const bool beyond = is_lower ? to_limit > 0 : to_limit < 0;
  return to_limit / step * (beyond ? kLimitRepair : 1);
}

JointAim PartJoint::aim(double repair) {
  measure();
  const btTransform a = m_rbA.getWorldTransform() * T_a_, b = m_rbB.getWorldTransform() * T_b_;
  const btVector3 gap = b.getOrigin() - a.getOrigin();
  JointAim aim;
  aim.point = b.getOrigin();
  aim.axis = a.getBasis().getColumn(0);
  aim.slides = prismatic_;
  aim.shift = -kRepair * repair * (prismatic_ ? gap - gap.dot(aim.axis) * aim.axis : gap);
  btVector3 turned(0, 0, 0);
  if (prismatic_) {
    for (int i = 0; i < 3; ++i) turned += a.getBasis().getColumn(i).cross(b.getBasis().getColumn(i)) / 2;
  } else {
    turned = aim.axis.cross(b.getBasis().getColumn(0));
  }
  aim.turn = -kRepair * repair * turned;
  aim.speed = motor_velocity_;
  aim.max_impulse = motor_effort_ * step;
  aim.limited = near_limit();
  if (aim.limited) aim.limit_speed = limit_speed(aim.is_lower);
  return aim;
}

void PartJoint::bore(const JointImpulse& impulse) {
  const btMatrix3x3 basis = m_rbA.getWorldTransform().getBasis() * T_a_.getBasis();
  const auto put = [&](std::size_t row, double value) { impulses[row] = value; };
  const auto moment = [&](int i) { return impulse.moment.dot(basis.getColumn(i)); };
  if (prismatic_) {
    for (int i = 0; i < 2; ++i) put(static_cast<std::size_t>(i), impulse.force.dot(basis.getColumn(1 + i)));
    for (int i = 0; i < 3; ++i) put(static_cast<std::size_t>(2 + i), moment(i));
    put(5, impulse.force.dot(basis.getColumn(0)) - impulse.limit);
  } else {
    for (int i = 0; i < 3; ++i) put(static_cast<std::size_t>(i), impulse.force[i]);
    put(3, moment(1));
    put(4, moment(2));
    put(5, moment(0) - impulse.limit);
  }
  put(6, impulse.limit);
}

void PartJoint::getInfo1(btConstraintInfo1* info) {
  info->nub = 0;
  if (in_tree_) {
    info->m_numConstraintRows = 0;
    return;
  }
  measure();
  rows = near_limit() ? 7 : 6;
  if (rows < 7) impulses[6] = 0;
  info->m_numConstraintRows = rows;
}

namespace {

/// Fills rows of a constraint's Jacobian; a row is the velocity of b relative to a.
class RowWriter {
 public:
  explicit RowWriter(btTypedConstraint::btConstraintInfo2& info) : info_(info) {}
  void linear(int row, const btVector3& axis, const btVector3& arm_a, const btVector3& arm_b) {
    set(info_.m_J1linearAxis, row, -axis);
    set(info_.m_J2linearAxis, row, axis);
    set(info_.m_J1angularAxis, row, -arm_a.cross(axis));
    set(info_.m_J2angularAxis, row, arm_b.cross(axis));
  }
  void angular(int row, const btVector3& axis) {
    set(info_.m_J1angularAxis, row, -axis);
    set(info_.m_J2angularAxis, row, axis);
  }
  void target(int row, double velocity) { info_.m_constraintError[row * info_.rowskip] = velocity; }
  void bound(int row, double low, double high) {
    info_.m_lowerLimit[row * info_.rowskip] = low;
    info_.m_upperLimit[row * info_.rowskip] = high;
  }

 private:
  void set(btScalar* rows, int row, const btVector3& v) const {
    for (int i = 0; i < 3; ++i) rows[row * info_.rowskip + i] = v[i];
  }
  btTypedConstraint::btConstraintInfo2& info_;
};

}  // namespace

void PartJoint::getInfo2(btConstraintInfo2* info) {
  RowWriter write(*info);
  const btTransform a = m_rbA.getWorldTransform() * T_a_, b = m_rbB.getWorldTransform() * T_b_;
  const btVector3 axis = a.getBasis().getColumn(0);
  const btVector3 u = a.getBasis().getColumn(1), v = a.getBasis().getColumn(2);
  const btVector3 gap = b.getOrigin() - a.getOrigin();
  const btVector3 arm_b = b.getOrigin() - m_rbB.getCenterOfMassPosition();
  const btVector3 arm_a = (prismatic_ ? b.getOrigin() : a.getOrigin()) - m_rbA.getCenterOfMassPosition();
  const double repair = kRepair * info->erp * info->fps;
  const double motor = motor_effort_ / info->fps;
  if (prismatic_) {
    write.linear(0, u, arm_a, arm_b);
    write.target(0, -repair * gap.dot(u));
    write.linear(1, v, arm_a, arm_b);
    write.target(1, -repair * gap.dot(v));
    btVector3 turned(0, 0, 0);
    for (int i = 0; i < 3; ++i) turned += a.getBasis().getColumn(i).cross(b.getBasis().getColumn(i)) / 2;
    const std::array<btVector3, 3> axes{axis, u, v};
    for (int i = 0; i < 3; ++i) {
      write.angular(2 + i, axes[static_cast<std::size_t>(i)]);
      write.target(2 + i, -repair * turned.dot(axes[static_cast<std::size_t>(i)]));
    }
    write.linear(5, axis, arm_a, arm_b);
  } else {
    for (int i = 0; i < 3; ++i) {
      btVector3 e(0, 0, 0);
      e[i] = 1;
      write.linear(i, e, arm_a, arm_b);
      write.target(i, -repair * gap[i]);
    }
    write.angular(3, u);
    write.angular(4, v);
    write.angular(5, axis);
    if (ball_) {
      for (int row = 3; row < 6; ++row) write.bound(row, -motor, motor);
      return;
    }
    const btVector3 turned = axis.cross(b.getBasis().getColumn(0));
    write.target(3, -repair * turned.dot(u));
    write.target(4, -repair * turned.dot(v));
  }
  write.target(5, motor_velocity_);
  write.bound(5, -motor, motor);
  if (rows < 7) return;
  if (prismatic_) {
    write.linear(6, axis, arm_a, arm_b);
  } else {
    write.angular(6, axis);
  }
  bool low = false;
  write.target(6, limit_speed(low));
  write.bound(6, low ? 0 : -SIMD_INFINITY, low ? SIMD_INFINITY : 0);
}

}  // namespace parhelion::simulation
