// Bullet's solver with two things more: surfaces that roll (wheels, tracks) and joints whose impulses are
// kept from one step to the next. Included by physics*.cpp only. The parts of PartSolver are
// physics_solver.cpp (setting up rows) and physics_sweeps.cpp (solving them); PartJoint is in
// physics_joint.cpp, Runner in physics_parts.cpp.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <array>
#include <memory>
#include <vector>

#include "server/simulation/joint_tree.hpp"
#include "server/simulation/physics.hpp"
#include "server/simulation/tree_contacts.hpp"

namespace parhelion::simulation {

/// Of a contact point's flags, beside Bullet's own: a runner's surface is in it.
constexpr int kRollingPoint = 1 << 20;

/// A wheel or track while the solver works with it.
struct Runner {
  btVector3 axis{0, 1, 0};  ///< it rolls about, to the left, in the inertial frame of its body
  double friction = 0.8;
  double speed = 0;            ///< m/s that the surface is asked to roll with; forward is positive
  double yield = 0;            ///< m/s that a weak motor's surface is slowed down by in a step
  double most_force = 0;       ///< N of its motor
  double normal_force = 0;     ///< N, summed over its contacts, of the newest step
  bool held_by_motor = false;  ///< the motor gives less than friction would (of its newest contact)

  // Summed up while the solver finishes a step: N s, N s, N m.
  double normal_impulse = 0;
  double forward_impulse = 0;
  double most_impulse = 0;  ///< of the motor
  double ground_moved = 0;  ///< normal impulse times m/s of the ground that goes by below
  RunnerMotion motion;

  /// One of its contacts: impulses, how fast the ground goes by, what the motor gives as a fraction of the
  /// load.
  void meet(double normal, double forward, double ground_speed, double motor_share) {
    normal_impulse += normal;
    forward_impulse += forward;
    most_impulse += motor_share * normal;
    ground_moved += normal * ground_speed;
  }
  /// Ends the step.
  void sum_up(double step);
};

/// What touches of a body can meet: by the index of the compound's child.
struct PartSurfaces {
  struct Surface {
    double friction = 0.6;
    int runner = -1;  ///< index into runners
  };
  std::vector<Surface> shapes;
  std::vector<Runner> runners;
  PhysicsHandle robot = 0;  ///< its first part
};

/// A joint between two parts. Those of robots are solved in a JointTree; doors and cables have rows in
/// Bullet's solver: for what they forbid, for a motor or friction, for a limit. Rows are kept from step to
/// step (warm starting), so that a chain of links stays still with few iterations.
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
  /// Of a joint in a tree, for this step; gaps are undone at the rate `repair`, 1/s.
  JointAim aim(double repair);
  /// What it bore in the step.
  void bore(const JointImpulse& impulse);
  /// Motor of 0: of a ball joint, what its friction can be asked for about each axis.
  void set_motor(double velocity, double effort) {
    motor_velocity_ = velocity;
    motor_effort_ = effort;
  }
  /// Its bodies are, or may be, elsewhere than when it was measured last.
  void moved() { measured_ = false; }
  /// Position, velocity as the bodies are now; turns of a revolute joint are counted.
  void measure();
  /// Forgets the impulses and the turns counted.
  void restart(double position);
  double position() const { return position_; }
  double velocity() const { return velocity_; }
  /// N m or N of the motor, and of what tears at the joint, in the newest step.
  double effort() const;
  double load() const;
  /// N that holds the parts together at the joint, in the newest step; 0 of one that slides.
  double pull() const;

  std::array<btScalar, kRows> impulses{};  ///< N s or N m s of the newest step, by row
  int rows = 0;                            ///< of the newest step
  double step;                             ///< s

 private:
  /// Near a limit it is looked after: which one, and the speed that it asks for.
  bool near_limit() const;
  double limit_speed(bool& is_lower) const;

  bool in_tree_;
  bool prismatic_;
  bool ball_;
  bool limited_;
  double lower_, upper_;
  btTransform T_a_, T_b_;  ///< the joint in the inertial frames; x is its axis
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
  double solve_normal(int contact);     // m/s that it changed
  double solve_friction(int friction);  // the same

  JointTree tree_;
  std::vector<PartJoint*> tree_joints_;
  TreeContacts tree_contacts_;
  std::vector<int> tree_rows_, tree_frictions_;  // by contact and by friction; -1: of no tree
};

/// The part that a collision object is, or nullptr.
inline PartSurfaces* part_of(const btCollisionObject* object) {
  return static_cast<PartSurfaces*>(object->getUserPointer());
}

}  // namespace parhelion::simulation
