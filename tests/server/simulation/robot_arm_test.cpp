// The arm of the tracked robot: its joints respect their limits and motors, break and stay broken, and its
// gripper lifts by contact and friction only.
#include <map>

#include "robots_world.hpp"
#include "tests/degree.hpp"
#include "tests/server/tick/crawler_arm.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

using test::kDegree;

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

TEST(RobotArm, JointsReachTheirTargetsWithinTheirLimits) {
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

TEST(RobotArm, ABrokenJointStaysBrokenUntilRestored) {
  Simulation simulation = make(floor_of(20), with_shoulder(110, 15));
  spawn(simulation, articulated("r", "crawler", 0, 0));
  run(simulation, 1);
  EXPECT_FALSE(broken(simulation, "shoulder_joint"));
  joints(simulation, {{"elbow_joint", 0}});  // its torque exceeds 20 N m when stretched out
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

TEST(RobotArm, AnExtendedArmHoldsStill) {
  Simulation simulation = make(floor_of(20), with_robots({"crawler"}));
  spawn(simulation, articulated("r", "crawler", 0, 0));
  joints(simulation, {{"shoulder_joint", 50 * kDegree}, {"elbow_joint", -70 * kDegree}});
  run(simulation, 6);
  double fastest = 0;
  for (int i = 0; i < 480; ++i) {
    run(simulation, 1.0 / 240);
    fastest = std::max(fastest, body(simulation, "r", "hand").velocity.norm());
  }
  EXPECT_LT(fastest, 0.005);
}

TEST(RobotArm, AJointWithZeroVelocityHoldsItsLoad) {
  Simulation simulation = make(floor_of(20), with_robots({"crawler"}));
  spawn(simulation, articulated("r", "crawler", 0, 0));
  joints(simulation, {{"shoulder_joint", 30 * kDegree}, {"elbow_joint", 0}});
  run(simulation, 5);
  const double stood = position(simulation, "shoulder_joint");
  Joints command;
  command.names = {"shoulder_joint"};
  const auto keep = [&](double velocity, double duration) {
    command.velocities = {velocity};
    for (int i = 0; i < std::lround(duration / 0.1); ++i) {
      ASSERT_TRUE(simulation.joint_command("r", command).ok());
      run(simulation, 0.1);
    }
  };
  keep(0, 5);
  EXPECT_NEAR(position(simulation, "shoulder_joint"), stood, 1e-3);
  keep(0.2, 1);
  keep(0, 5);
  EXPECT_NEAR(position(simulation, "shoulder_joint"), stood + 0.2, 2e-3) << "as commanded";
}

/// Moves the point between the finger pads to (x, z) of base_link, fingers down.
void reach(Simulation& simulation, double x, double z) { joints(simulation, crawler_reach(x - kTurret, z)); }

void fingers(Simulation& simulation, double opening) {
  joints(simulation, {{"left_finger_joint", opening}});  // the other one is geared to it
}

TEST(RobotArm, AGearedJointFollowsWithItsMultiplierAndOffset) {
  RobotModel crawler = *shipped("crawler");
  const std::string mimic = "<mimic joint=\"left_finger_joint\"";
  crawler.urdf.insert(crawler.urdf.find(mimic) + mimic.size(), " multiplier=\"0.5\" offset=\"0.01\"");
  auto geared = parse_robot_model(crawler.urdf, crawler.yaml, "crawler.yaml");
  ASSERT_TRUE(geared.ok()) << geared.error().message;
  SimulationOptions options;
  options.robot_models = {std::make_shared<const RobotModel>(std::move(*geared))};
  Simulation simulation = make(floor_of(20), options);
  spawn(simulation, articulated("r", "crawler", 0, 0));
  run(simulation, 1);
  EXPECT_NEAR(position(simulation, "right_finger_joint"),
              0.5 * position(simulation, "left_finger_joint") + 0.01, 0.002);
  for (const double opening : {0.06, 0.02}) {
    fingers(simulation, opening);
    run(simulation, 2);
    EXPECT_NEAR(position(simulation, "left_finger_joint"), opening, 0.003);
    EXPECT_NEAR(position(simulation, "right_finger_joint"), 0.5 * opening + 0.01, 0.003);
  }
}

TEST(RobotArm, TheGripperLiftsABoxByFrictionAndReleasesIt) {
  Simulation simulation = make(floor_of(20), with_robots({"crawler"}));
  spawn(simulation, articulated("r", "crawler", 0, 0));
  AgentDefinition load = agent("load", AgentKind::box, 0.80, 0);
  load.size = {0.08, 0.08, 0.16};
  spawn(simulation, load);
  reach(simulation, 0.80, 0.40);
  run(simulation, 5);
  reach(simulation, 0.80, 0.11);
  run(simulation, 3);
  EXPECT_LT(body(simulation, "load").T_map_body.translation().z(), 0.01);
  fingers(simulation, 0.079);
  run(simulation, 1.5);
  EXPECT_LT(position(simulation, "left_finger_joint"), 0.06) << "the box is between them";
  reach(simulation, 0.75, 0.45);
  run(simulation, 4);
  const double lifted = body(simulation, "load").T_map_body.translation().z();
  EXPECT_GT(lifted, 0.25);
  run(simulation, 3);
  EXPECT_NEAR(body(simulation, "load").T_map_body.translation().z(), lifted, 0.0005) << "it slips";
  EXPECT_NEAR(body(simulation, "load").T_map_body.translation().y(), 0, 0.005) << "fingers are geared";
  fingers(simulation, 0);
  run(simulation, 2);
  EXPECT_LT(body(simulation, "load").T_map_body.translation().z(), 0.1);
  EXPECT_LT(body(simulation, "load").velocity.norm(), 0.01);
}

}  // namespace
}  // namespace parhelion::simulation
