// The arm of the tracked robot: its joints keep to their limits and motors, break and stay broken.
#include <map>

#include "robots_world.hpp"

namespace parhelion {
namespace {

using namespace test;

constexpr double kDegree = std::numbers::pi / 180;

void joints(Simulation& simulation, const std::map<std::string, double>& positions) {
  Joints command;
  for (const auto& [name, position] : positions) {
    command.names.push_back(name);
    command.positions.push_back(position);
  }
  const Status status = simulation.joint_command("r", command);
  ASSERT_TRUE(status.ok()) << status.error().message;
}

std::size_t index(const RobotMotion& motion, const std::string& joint) {
  const auto at = std::find(motion.joints.names.begin(), motion.joints.names.end(), joint);
  EXPECT_NE(at, motion.joints.names.end()) << joint;
  return static_cast<std::size_t>(at - motion.joints.names.begin());
}

double position(const Simulation& simulation, const std::string& joint) {
  return motion(simulation, "r").joints.positions[index(motion(simulation, "r"), joint)];
}

bool broken(const Simulation& simulation, const std::string& joint) {
  return motion(simulation, "r").broken[index(motion(simulation, "r"), joint)];
}

/// The tracked robot with another shoulder.
SimulationOptions with_shoulder(double effort, double break_effort) {
  RobotModel model = *shipped("crawler");
  for (RobotJoint& joint : model.joints) {
    if (joint.name != "shoulder_joint") continue;
    joint.effort = effort;
    joint.break_effort = break_effort;
  }
  SimulationOptions options;
  options.robot_models.push_back(std::make_shared<const RobotModel>(model));
  return options;
}

TEST(RobotArm, JointsGoWhereTheyAreSentAndNoFurtherThanTheirLimits) {
  Simulation simulation = make(floor_of(20), with_robots({"crawler"}));
  spawn(simulation, articulated("r", "crawler", 0, 0));
  const std::map<std::string, double> goals{{"turret_joint", 60 * kDegree},
                                            {"shoulder_joint", 70 * kDegree},
                                            {"elbow_joint", -50 * kDegree},
                                            {"wrist_joint", 20 * kDegree}};
  joints(simulation, goals);
  run(simulation, 6);
  for (const auto& [joint, goal] : goals)
    EXPECT_NEAR(position(simulation, joint), goal, 0.5 * kDegree) << joint;
  joints(simulation, {{"wrist_joint", 10}});
  run(simulation, 3);
  EXPECT_NEAR(position(simulation, "wrist_joint"), 2, 0.5 * kDegree);
  EXPECT_EQ(count(simulation.take_events(), EventKind::joint_broken), 0U);
}

TEST(RobotArm, AJointThatIsTornOffStaysBrokenUntilItIsRestored) {
  Simulation simulation = make(floor_of(20), with_shoulder(110, 15));
  spawn(simulation, articulated("r", "crawler", 0, 0));
  run(simulation, 1);
  EXPECT_FALSE(broken(simulation, "shoulder_joint"));
  joints(simulation, {{"elbow_joint", 0}});  // stretched out it weighs more than 20 N m
  run(simulation, 5);
  const auto events = only(simulation.take_events(), EventKind::joint_broken);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].subject, "r");
  EXPECT_EQ(events[0].object, "shoulder_joint");
  EXPECT_GE(events[0].value, 15);
  EXPECT_TRUE(broken(simulation, "shoulder_joint"));
  joints(simulation, {{"shoulder_joint", 60 * kDegree}});
  run(simulation, 3);
  EXPECT_TRUE(broken(simulation, "shoulder_joint"));
  EXPECT_LT(body(simulation, "r", "upper_arm").T_map_body.translation().z(), 0.3) << "it lies somewhere";
  const Status status = simulation.restore_joints("r");
  ASSERT_TRUE(status.ok()) << status.error().message;
  run(simulation, 1);
  EXPECT_FALSE(broken(simulation, "shoulder_joint"));
  EXPECT_NEAR(position(simulation, "shoulder_joint"), 8 * kDegree, 1 * kDegree);
  EXPECT_EQ(count(simulation.take_events(), EventKind::joints_restored), 1U);
}

TEST(RobotArm, AMotorThatCannotHoldItsLoadIsOverloaded) {
  Simulation simulation = make(floor_of(20), with_shoulder(6, 0));
  spawn(simulation, articulated("r", "crawler", 0, 0));
  joints(simulation, {{"elbow_joint", 0}, {"shoulder_joint", 60 * kDegree}});
  run(simulation, 6);
  const auto events = only(simulation.take_events(), EventKind::joint_overload);
  ASSERT_GE(events.size(), 1U);
  EXPECT_EQ(events[0].object, "shoulder_joint");
  EXPECT_GE(events[0].value, 0.99);
  EXPECT_LT(position(simulation, "shoulder_joint"), 30 * kDegree);
}

}  // namespace
}  // namespace parhelion
