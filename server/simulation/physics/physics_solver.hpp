// Bullet's solver with two extensions: rolling surfaces (wheels, tracks), and joints whose impulses are kept
// from one step to the next. Included by physics*.cpp only. PartSolver is implemented in physics_solver.cpp
// (row setup) and physics_sweeps.cpp (iterations); PartJoint in physics_joint.cpp, Runner in
// physics_parts.cpp.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <array>
#include <memory>
#include <vector>

#include "server/simulation/physics/joint_tree.hpp"
#include "server/simulation/physics/physics.hpp"
#include "server/simulation/physics/tree_contacts.hpp"

namespace parhelion::simulation {

/// Flag of a contact point, beside Bullet's own: it involves a runner's surface.
constexpr int kRollingPoint = 1 << 20;

/// State of a wheel or track in the solver.
struct Runner {
  btVector3 axis{0, 1, 0};  ///< axis of rotation, to the left, in the inertial frame of its body
  double friction = 0.8;
  double speed = 0;            ///< m/s, commanded speed of the surface; forward is positive
  double yield = 0;            ///< m/s, maximum slowdown of the surface in a step with a weak motor
  double max_force = 0;        ///< N, maximum of its motor
  double normal_force = 0;     ///< N, summed over its contacts, of the newest step
  bool held_by_motor = false;  ///< limited by the motor, not by friction (at its newest contact)

  // Sums at the end of a step: N s, N s, N m.
  double normal_impulse = 0;
  double forward_impulse = 0;
  double max_impulse = 0;   ///< maximum of the motor
  double ground_moved = 0;  ///< sum of normal impulse times speed (m/s) of the ground below
  RunnerMotion motion;

  /// Adds one of its contacts: impulses, ground speed, and the motor's fraction of the load.
  void meet(double normal, double forward, double ground_speed, double motor_fraction) {
    normal_impulse += normal;
    forward_impulse += forward;
    max_impulse += motor_fraction * normal;
    ground_moved += normal * ground_speed;
  }
  /// Completes the step.
  void sum_up(double step);
};

/// Surface properties of a body: by the index of the compound's child.
struct PartSurfaces {
  struct Surface {
    double friction = 0.6;
    int runner = -1;  ///< index into runners
  };
  std::vector<Surface> shapes;
  std::vector<Runner> runners;
  PhysicsHandle robot = 0;  ///< the robot's first part
};

/// A joint between two parts. Robots' joints are solved in a JointTree; doors and cables have rows in
/// Bullet's solver: for the constraint, for a motor or friction, and for a limit. Impulses are kept from step
/// to step (warm starting), so that a chain of links stays at rest with few iterations.
class PartJoint : public btTypedConstraint {
 public:
  static constexpr int kRows = 7;
  static constexpr int kUserType = 7301;  ///< distinguishes it from other constraints
  PartJoint(const JointDefinition& definition, btRigidBody& a, btRigidBody& b,
            const Eigen::Isometry3d& T_inertial_a, const Eigen::Isometry3d& T_inertial_b, double step,
            bool in_tree);

  void getInfo1(btConstraintInfo1* info) override;
  void getInfo2(btConstraintInfo2* info) override;
  void setParam(int, btScalar, int) override {}
  btScalar getParam(int, int) const override { return 0; }

  bool in_tree() const { return in_tree_; }
  /// Target of a joint in a tree, for this step; position errors are corrected at the rate `repair`, 1/s.
  JointAim aim(double repair);
  /// Stores the joint load of the step.
  void bore(const JointImpulse& impulse);
  /// Motor of speed 0: for a ball joint, its maximum friction about each axis.
  void set_motor(double velocity, double effort) {
    motor_velocity_ = velocity;
    motor_effort_ = effort;
  }
  /// Its bodies may have moved since the last measurement.
  void moved() { measured_ = false; }
  /// Updates position and velocity from the bodies; turns of a revolute joint are counted.
  void measure();
  /// Resets the impulses and the turn count.
  void restart(double position);
  double position() const { return position_; }
  double velocity() const { return velocity_; }
  /// N m or N of the motor, and of the load on the joint, in the newest step.
  double effort() const;
  double load() const;
  /// N, constraint force at the joint in the newest step; 0 for a sliding joint.
  double pull() const;

  std::array<btScalar, kRows> impulses{};  ///< N s or N m s of the newest step, by row
  int rows = 0;                            ///< of the newest step
  double step;                             ///< s

 private:
  /// Whether a limit is active: which one, and the speed bound there.
  bool near_limit() const;
  double limit_speed(bool& is_lower) const;

  bool in_tree_;
  bool prismatic_;
  bool ball_;
  bool limited_;
  double lower_, upper_;
  btTransform T_a_, T_b_;  ///< the joint frame in the inertial frames; x is its axis
  double motor_velocity_ = 0, motor_effort_ = 0;
  double position_ = 0, velocity_ = 0;
  bool measured_ = false;
};

class PartSolver : public btSequentialImpulseConstraintSolver {
 protected:
  void convertContacts(btPersistentManifold** manifolds, int count, const btContactSolverInfo& info) override;
  void convertJoints(btTypedConstraint** constraints, int count, const btContactSolverInfo& info) override;
  btScalar solveGroupCacheFriendlySetup(btCollisionObject** bodies, int count,
                                        btPersistentManifold** manifolds, int manifold_count,
                                        btTypedConstraint** constraints, int constraint_count,
                                        const btContactSolverInfo& info, btIDebugDraw* drawer) override;
  void solveGroupCacheFriendlySplitImpulseIterations(btCollisionObject** bodies, int count,
                                                     btPersistentManifold** manifolds, int manifold_count,
                                                     btTypedConstraint** constraints, int constraint_count,
                                                     const btContactSolverInfo& info,
                                                     btIDebugDraw* drawer) override;
  btScalar solveGroupCacheFriendlyIterations(btCollisionObject** bodies, int count,
                                             btPersistentManifold** manifolds, int manifold_count,
                                             btTypedConstraint** constraints, int constraint_count,
                                             const btContactSolverInfo& info, btIDebugDraw* drawer) override;
  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                         const btContactSolverInfo& info) override;

 private:
  void limit_motors(int first_contact, int last_contact);
  void plant(btTypedConstraint** constraints, int count, const btContactSolverInfo& info);
  bool settle_trees();
  double sweep();
  double solve_normal(int contact);     // change, m/s
  double solve_friction(int friction);  // change, m/s

  JointTree tree_;
  std::vector<PartJoint*> tree_joints_;
  TreeContacts tree_contacts_;
  std::vector<int> tree_rows_, tree_frictions_;  // by contact and by friction; -1: not in a tree
};

/// The robot part of a collision object, or nullptr.
inline PartSurfaces* part_of(const btCollisionObject* object) {
  return static_cast<PartSurfaces*>(object->getUserPointer());
}

}  // namespace parhelion::simulation
