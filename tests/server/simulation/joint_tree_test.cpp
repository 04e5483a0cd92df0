// A light link between a heavy base and a heavy load: joint loads against statics.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "server/simulation/physics/physics.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kTreeStep = 1.0 / 240, kGravity = 9.81;
constexpr double kLink = 0.05, kLoad = 3;  // kg
constexpr double kReach = 0.5;             // m from each joint to the next, and to the load
// N m about the first joint, of both stretched out.
constexpr double kTorque = kGravity * (kLink * kReach / 2 + kLoad * kReach);

PartDefinition part(const Eigen::Vector3d& size, double mass) {
  PartDefinition part;
  PartShape shape;
  shape.shape.size = size;
  part.shapes = {shape};
  part.mass = mass;
  const Eigen::Vector3d squares = size.cwiseAbs2();
  part.inertia = (mass / 12 * (squares.sum() * Eigen::Vector3d::Ones() - squares)).asDiagonal();
  return part;
}

Transform<Map, Body> at(double x, double z) {
  return Transform<Map, Body>(Eigen::Isometry3d(Eigen::Translation3d(x, 0, z)));
}

/// A hinge about y: a positive angle lowers the part ahead.
Eigen::Isometry3d hinge_at(double x, double z) {
  return Eigen::Translation3d(x, 0, z) *
         Eigen::Isometry3d(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
}

class Arm {
 public:
  explicit Arm(bool limited = false, int sweeps = 0, double link = kLink, double load = kLoad)
      : physics_(kTreeStep, sweeps) {
    physics_.add_floor(0);
    handles_ = physics_.add_parts(
        {part({1.6, 0.6, 0.2}, 30), part({0.3, 0.02, 0.02}, link), part({0.1, 0.1, 0.1}, load)},
        {at(0, 0.1), at(kReach / 2, 0.5), at(kReach, 0.5)});
    JointDefinition shoulder;
    shoulder.a = handles_[0];
    shoulder.b = handles_[1];
    shoulder.T_a_joint = hinge_at(0, 0.4);
    shoulder.T_b_joint = hinge_at(-kReach / 2, 0);
    shoulder.limited = limited;
    shoulder.lower = -0.3;
    shoulder.upper = 0.2;
    JointDefinition wrist;
    wrist.a = handles_[1];
    wrist.b = handles_[2];
    wrist.T_a_joint = hinge_at(kReach / 2, 0);
    wrist.T_b_joint = hinge_at(0, 0);
    shoulder_ = physics_.add_joint(shoulder);
    wrist_ = physics_.add_joint(wrist);
    for (const PhysicsHandle handle : handles_) physics_.keep_awake(handle, true);
  }
  void run(double seconds, double effort) {
    for (long i = std::lround(seconds / kTreeStep); i > 0; --i) {
      physics_.drive_joint(shoulder_, 0, effort);
      physics_.drive_joint(wrist_, 0, 50);
      physics_.step();
    }
  }
  /// The base is 0, the load 2.
  RigidState state(int part) const { return physics_.state(handles_[static_cast<std::size_t>(part)]); }
  JointState shoulder() const { return physics_.joint_state(shoulder_); }
  JointState wrist() const { return physics_.joint_state(wrist_); }

 private:
  Physics physics_;
  std::vector<PhysicsHandle> handles_;
  JointHandle shoulder_ = 0, wrist_ = 0;
};

TEST(JointTree, ALightLinkHoldsAHeavyLoadWithStaticTorque) {
  Arm arm;
  arm.run(2, 100);
  EXPECT_NEAR(arm.shoulder().position, 0, 1e-4);
  EXPECT_NEAR(arm.wrist().position, 0, 1e-4);
  EXPECT_NEAR(arm.shoulder().velocity, 0, 1e-5);
  EXPECT_NEAR(std::abs(arm.shoulder().effort), kTorque, 0.001 * kTorque);
  EXPECT_NEAR(std::abs(arm.wrist().effort), 0, 0.01);
  EXPECT_NEAR(arm.shoulder().pull, kGravity * (kLink + kLoad), 0.05);
  EXPECT_NEAR(arm.wrist().pull, kGravity * kLoad, 0.05);
}

TEST(JointTree, AWeakMotorYieldsAtItsMaximumEffort) {
  Arm arm;
  arm.run(0.1, 5);
  EXPECT_NEAR(std::abs(arm.shoulder().effort), 5, 1e-9);
  // About the shoulder: the weight's remaining torque over the inertia.
  const double inertia = kLink * (0.3 * 0.3 + 0.02 * 0.02) / 12 + kLink * kReach * kReach / 4 +
                         kLoad * kReach * kReach + kLoad * 2 * 0.1 * 0.1 / 12;
  const double turned = (kTorque - 5) / inertia * 0.1;
  EXPECT_NEAR(arm.shoulder().velocity, turned, 0.01 * turned);
}

TEST(JointTree, AJointLimitHoldsWithoutAMotor) {
  Arm arm(true);
  arm.run(2, 0);
  EXPECT_NEAR(arm.shoulder().position, 0.2, 2e-3);
  EXPECT_NEAR(arm.shoulder().velocity, 0, 1e-3);
  EXPECT_EQ(arm.shoulder().effort, 0);
  EXPECT_NEAR(arm.shoulder().load, std::cos(0.2) * kTorque, 0.05 * kTorque);
}

/// Falls on the floor, pushes itself up, and is released: contacts, a holding motor and a yielding one, free
/// motion and at a limit.
TEST(JointTree, EqualsManySweepsOverAllConstraintRows) {
  constexpr double weight = 1;  // kg; sweeps converge slowly for large mass ratios
  Arm exact(true, 0, weight, weight), swept(true, 2000, weight, weight);
  for (const double effort : {0.0, 60.0, 12.0}) {
    for (int i = 0; i < 24; ++i) {
      exact.run(5 * kTreeStep, effort);
      swept.run(5 * kTreeStep, effort);
      for (int part = 0; part < 3; ++part) {
        const RigidState a = exact.state(part), b = swept.state(part);
        ASSERT_LT((a.T_map_body.translation() - b.T_map_body.translation()).norm(), 2e-4)
            << "part " << part << ", effort " << effort << ", step " << 5 * i;
        ASSERT_LT((a.velocity - b.velocity).norm(), 1e-3);
      }
    }
  }
}

}  // namespace
}  // namespace parhelion::simulation
