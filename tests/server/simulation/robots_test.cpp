// Articulated robots start at the model's pose, drive as their wheels roll, and stop at obstacles.
#include "robots_world.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

TEST(Robots, EveryShippedRobotStandsWhereItWasPlaced) {
  for (const std::string& name : shipped_robot_models()) {
    Simulation simulation = make(floor_of(20), with_robots({name}));
    spawn(simulation, articulated("r", name, 1, 2, 0.5));
    run(simulation, 3);
    const RobotMotion& at = motion(simulation, "r");
    EXPECT_NEAR(at.T_map_base.translation().x(), 1, 0.01) << name;
    EXPECT_NEAR(at.T_map_base.translation().y(), 2, 0.01) << name;
    EXPECT_NEAR(at.T_map_base.translation().z(), 0, 0.01) << name;
    EXPECT_NEAR(at.T_map_base.yaw(), 0.5, 0.01) << name;
    EXPECT_GT(at.T_map_base.rotation()(2, 2), 0.999) << name;
    EXPECT_LT(at.velocity.norm(), 1e-3) << name;
    EXPECT_LT(at.rotation_rate.norm(), 1e-3) << name;
  }
}

TEST(Robots, RollingWheelsCoverTheirCircumferencePerTurn) {
  Simulation simulation = make(floor_of(40), with_robots({"rover"}));
  spawn(simulation, articulated("r", "rover", 0, 0));
  drive(simulation, "r", {0.5, 0, 0}, 4);
  const double rolled = motion(simulation, "r").left,
               driven = motion(simulation, "r").T_map_base.translation().x();
  EXPECT_GT(driven, 1.5);
  EXPECT_NEAR(rolled, driven, 0.01 * driven);
  // The visible wheel is turned by its travel over its radius.
  const BodyState wheel = body(simulation, "r", "left_wheel");
  EXPECT_NEAR(std::remainder(rolled / 0.0975 - std::atan2(-wheel.T_map_body.rotation()(2, 0),
                                                          wheel.T_map_body.rotation()(0, 0)),
                             2 * std::numbers::pi),
              0, 0.01);
  EXPECT_NEAR(wheel.rotation_rate.y(), 0.5 / 0.0975, 0.1);
}

TEST(Robots, TurnsOnTheSpotAccordingToItsTrackWidth) {
  Simulation simulation = make(floor_of(20), with_robots({"rover"}));
  spawn(simulation, articulated("r", "rover", 0, 0));
  drive(simulation, "r", {0, 0, 1.0}, 2);
  const RobotMotion& at = motion(simulation, "r");
  EXPECT_NEAR(at.rotation_rate.z(), 1.0, 0.03);
  EXPECT_LT(at.T_map_base.translation().norm(), 0.05);
  EXPECT_NEAR((at.right - at.left) / 0.37, at.T_map_base.yaw(), 0.03);
}

TEST(Robots, StopsWithoutCommandsAndAtWalls) {
  Simulation simulation = make(room(6), with_robots({"rover"}));
  spawn(simulation, articulated("r", "rover", 0, 0));
  drive(simulation, "r", {0.5, 0, 0}, 2);
  run(simulation, 2);  // the command holds for half a second
  EXPECT_LT(motion(simulation, "r").velocity.norm(), 1e-3);
  drive(simulation, "r", {0.5, 0, 0}, 8);
  const RobotMotion& at = motion(simulation, "r");
  EXPECT_NEAR(at.T_map_base.translation().x(), 3 - 0.204, 0.02);
  EXPECT_GT(at.T_map_base.rotation()(2, 2), 0.99);
  // Its motors are too weak for the wheels to slip: they stop, and so do the encoders.
  EXPECT_NEAR(at.left, at.T_map_base.translation().x(), 0.05);
  ASSERT_EQ(at.touching.size(), 1U);
  EXPECT_EQ(at.touching.front(), "bumper");
  bool collided = false;
  for (const Event& event : simulation.take_events()) {
    collided = collided ||
               (event.kind == EventKind::contact_started && event.subject == "r" && event.object == "wall 1");
    EXPECT_NE(event.object, "floor");
  }
  EXPECT_TRUE(collided);
}

TEST(Robots, StrongMotorsSpinTheWheelsAtAWall) {
  SimulationOptions options;
  RobotModel strong = *shipped("rover");
  strong.drive.force = 500;
  options.robot_models.push_back(std::make_shared<const RobotModel>(strong));
  Simulation simulation = make(room(6), options);
  spawn(simulation, articulated("r", "rover", 0, 0));
  drive(simulation, "r", {0.5, 0, 0}, 10);
  const RobotMotion& at = motion(simulation, "r");
  EXPECT_NEAR(at.T_map_base.translation().x(), 3 - 0.204, 0.03);
  EXPECT_GT(at.left, at.T_map_base.translation().x() + 0.5);
}

TEST(Robots, OtherAgentsTreatTheTraineesRobotAsReal) {
  Simulation simulation = make(floor_of(20), with_robots({"rover"}));
  EXPECT_FALSE(simulation.spawn_trainee(agent("t", AgentKind::robot, 0, 0)).ok());
  const Status status = simulation.spawn_trainee(articulated("pioneer", "rover", 0, 0));
  ASSERT_TRUE(status.ok()) << status.error().message;
  EXPECT_FALSE(simulation.spawn_trainee(articulated("second", "rover", 3, 0)).ok());
  spawn(simulation, agent("crate", AgentKind::box, 0.8, 0));
  drive(simulation, "pioneer", {0.6, 0, 0}, 2);
  int bodies = 0;
  for (const auto& definition : simulation.scene()->bodies) {
    if (definition->entity != "pioneer" || definition->part == "base") continue;
    ++bodies;
    EXPECT_EQ(definition->owner, BodyOwner::real_robot);
    EXPECT_FALSE(definition->injectable);
  }
  EXPECT_EQ(bodies, 3);  // base and two wheels
  bool met = false;
  for (const Event& event : simulation.take_events()) {
    if (event.kind != EventKind::contact_started) continue;
    met = true;
    EXPECT_EQ(event.subject, "pioneer");
    EXPECT_EQ(event.object, "crate");
    EXPECT_EQ(event.pair, PairKind::real_virtual);
    EXPECT_FALSE(event.undetectable);
  }
  EXPECT_TRUE(met);
  EXPECT_FALSE(simulation.command(AgentRemove{.agent = "pioneer"}, std::nullopt).ok());
}

TEST(Robots, UnknownModelsAndJointsAreNamed) {
  Simulation simulation = make(floor_of(20), with_robots({"rover"}));
  const Status status = simulation.spawn(articulated("r", "rovre", 0, 0), std::nullopt);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("did you mean 'rover'"), std::string::npos) << status.error().message;
  spawn(simulation, articulated("r", "rover", 0, 0));
  Joints joints;
  joints.names = {"elbow"};
  joints.positions = {0.5};
  const Status unknown = simulation.joint_command("r", joints);
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("'elbow'"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::simulation
