#include "server/simulation/physics/physics.hpp"

#include <gmock/gmock.h>

#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

TEST(Physics, EveryKindOfAgentRestsOnTheFloorAndStaysThere) {
  Simulation simulation = make(room(8));
  int x = -3;
  for (const AgentKind kind : {AgentKind::box, AgentKind::barrel, AgentKind::person, AgentKind::robot}) {
    spawn(simulation, agent(to_string(kind), kind, x++, 0, 0.3));
  }
  run(simulation, 5);
  x = -3;
  for (const AgentKind kind : {AgentKind::box, AgentKind::barrel, AgentKind::person, AgentKind::robot}) {
    const BodyState state = body(simulation, to_string(kind));
    EXPECT_NEAR(state.T_map_body.translation().x(), x++, 1e-6) << to_string(kind);
    EXPECT_NEAR(state.T_map_body.translation().z(), 0, 1e-6) << to_string(kind);
    EXPECT_NEAR(state.T_map_body.yaw(), 0.3, 1e-6) << to_string(kind);
  }
}

TEST(Physics, AModelWithoutAFloorHasOneAtZero) {
  Simulation simulation = make();
  spawn(simulation, agent("crate", AgentKind::box, 0, 0));
  run(simulation, 2);
  EXPECT_NEAR(body(simulation, "crate").T_map_body.translation().z(), 0, 1e-6);
}

TEST(Physics, AgentsStandOnTheModelFloorAtAnyHeight) {
  SemanticModel model = room(8);
  for (ModelEntity& part : model.entities) {
    part.T_map_body = Transform<Map, Body>(part.T_map_body.quaternion(),
                                           part.T_map_body.translation() - Eigen::Vector3d(0, 0, 1.3));
  }
  Simulation simulation = make(model);
  spawn(simulation, agent("crate", AgentKind::box, 1, 1));
  spawn(simulation, agent("rover", AgentKind::robot, -1, 1));
  run(simulation, 1);
  EXPECT_NEAR(body(simulation, "crate").T_map_body.translation().z(), -1.3, 1e-6);
  EXPECT_NEAR(body(simulation, "rover").T_map_body.translation().z(), -1.3, 1e-6);
}

TEST(Physics, AgentsStandOnASlightlyTiltedFloor) {
  SemanticModel model;
  ModelEntity floor = model_box("floor", EntityLabel::floor, {0, 0, 0}, {20, 20, 0.1});
  const double tilt = 0.5 * std::numbers::pi / 180;
  floor.T_map_body = Transform<Map, Body>(
      Eigen::Quaterniond(Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY())), {0, 0, -0.05});
  model.entities.push_back(floor);
  Simulation simulation = make(model);
  spawn(simulation, agent("rover", AgentKind::robot, 5, 0));
  spawn(simulation, agent("crate", AgentKind::box, -5, 0));
  spawn(simulation, agent("low", AgentKind::box, 5, 3));
  run(simulation, 1);
  EXPECT_NEAR(body(simulation, "rover").T_map_body.translation().z(), -5 * std::tan(tilt), 1e-3);
  EXPECT_NEAR(body(simulation, "low").T_map_body.translation().z(), -5 * std::tan(tilt), 3e-3);
  EXPECT_NEAR(body(simulation, "crate").T_map_body.translation().z(), 5 * std::tan(tilt), 3e-3);
}

TEST(Physics, AnAgentSqueezedAgainstAWallIsNotFlung) {
  for (const AgentKind kind : {AgentKind::robot, AgentKind::person, AgentKind::box, AgentKind::barrel}) {
    Simulation simulation = make(room(6));
    spawn(simulation, agent("victim", kind, 2.2, 0.05));
    std::vector<LaserRequest> requests;
    double fastest = 0;
    for (int i = 0; i < 2400; ++i) {
      const double x = std::min(2.6, 0.5 + 0.6 * i / 240);
      simulation.step(real_at(x, 0, 0, {x < 2.6 ? 0.6 : 0, 0, 0}), requests);
      const BodyState state = body(simulation, "victim");
      ASSERT_TRUE(state.T_map_body.finite());
      fastest = std::max(fastest, state.velocity.norm());
    }
    EXPECT_LT(fastest, 6) << to_string(kind);
    EXPECT_LT(body(simulation, "victim").T_map_body.translation().norm(), 6) << to_string(kind);
  }
}

TEST(Physics, ADrivenRobotReachesItsSpeedWithoutSideslipOrTipping) {
  Simulation simulation = make(room(20));
  spawn(simulation, moving("rover", AgentKind::robot, -5, 0, BehaviourKind::teleop));
  drive(simulation, "rover", {0.5, 0.3, 0}, 4);  // a differential drive has no sideways
  const BodyState state = body(simulation, "rover", "chassis");
  EXPECT_NEAR(state.velocity.x(), 0.5, 1e-6);
  EXPECT_NEAR(state.T_map_body.translation().y(), 0, 1e-9);
  EXPECT_NEAR(state.T_map_body.rotation()(2, 2), 1, 1e-12);
  const BodyState wheel = body(simulation, "rover", "left_wheel");
  EXPECT_NEAR(wheel.rotation_rate.y(), 0.5 / 0.11, 1e-3) << "rolls without slipping";
}

TEST(Physics, ATeleopTimeoutOfHalfASecondStopsTheRobot) {
  Simulation simulation = make(room(20));
  spawn(simulation, moving("rover", AgentKind::robot, -5, 0, BehaviourKind::teleop));
  drive(simulation, "rover", {0.5, 0, 0}, 2);
  run(simulation, 0.4);
  EXPECT_NEAR(body(simulation, "rover").velocity.x(), 0.5, 1e-6);
  run(simulation, 2);
  EXPECT_NEAR(body(simulation, "rover").velocity.norm(), 0, 1e-6);
}

TEST(Physics, ARobotThatDrivesIntoAWallStopsThere) {
  Simulation simulation = make(room(6));
  spawn(simulation, moving("rover", AgentKind::robot, 0, 0, BehaviourKind::teleop));
  drive(simulation, "rover", {0.8, 0, 0}, 10);
  EXPECT_NEAR(body(simulation, "rover").T_map_body.translation().x(), 3 - 0.26, 0.01);
  const auto events = simulation.take_events();
  ASSERT_EQ(count(events, EventKind::contact_started), 1U);
  for (const Event& event : events) {
    if (event.kind != EventKind::contact_started) continue;
    EXPECT_EQ(event.subject, "rover");
    EXPECT_EQ(event.object, "wall 1");
    EXPECT_EQ(event.pair, PairKind::real_virtual);
    EXPECT_NEAR(event.impulse, 30 * 0.8, 30 * 0.8 * 0.2) << "its momentum";
    EXPECT_NEAR(event.position.x(), 3, 0.02);
  }
}

TEST(Physics, ARobotPushesBoxesAndTopplesBarrelsHitHigh) {
  Simulation simulation = make(room(20));
  spawn(simulation, moving("rover", AgentKind::robot, 0, 0, BehaviourKind::teleop));
  AgentDefinition tall = agent("tall", AgentKind::box, 1.0, 0);
  tall.size = {0.2, 0.2, 1.6};
  AgentDefinition low = agent("low", AgentKind::box, 1.0, 3);
  low.size = {0.4, 0.4, 0.3};
  spawn(simulation, tall);
  spawn(simulation, low);
  spawn(simulation, moving("rover2", AgentKind::robot, 0, 3, BehaviourKind::teleop));
  std::vector<LaserRequest> requests;
  for (int i = 0; i < 1200; ++i) {
    simulation.teleop("rover", {0.8, 0, 0});
    simulation.teleop("rover2", {0.8, 0, 0});
    simulation.step({}, requests);
  }
  EXPECT_GT(body(simulation, "low").T_map_body.translation().x(), 2);
  EXPECT_NEAR(body(simulation, "low").T_map_body.translation().z(), 0, 0.005);
  EXPECT_GT(body(simulation, "tall").T_map_body.translation().x(), 1.5);
}

TEST(Physics, TheRealRobotPushesAgentsAndIsNotPushed) {
  Simulation simulation = make(room(20));
  spawn(simulation, agent("rover", AgentKind::robot, 1.0, 0));
  std::vector<LaserRequest> requests;
  for (int i = 0; i <= 480; ++i) {
    simulation.step(real_at(0.5 * i / 240, 0, 0, {0.5, 0, 0}), requests);
  }
  const double front = 0.5 * 2 + 0.25;
  EXPECT_NEAR(body(simulation, "rover").T_map_body.translation().x(), front + 0.26, 0.02);
  EXPECT_NEAR(body(simulation, "pioneer").T_map_body.translation().x(), 1.0, 1e-12);
  const auto events = simulation.take_events();
  bool contact_reported = false;
  for (const Event& event : events) {
    if (event.kind != EventKind::contact_started) continue;
    contact_reported = true;
    EXPECT_EQ(event.subject, "pioneer");
    EXPECT_EQ(event.object, "rover");
    EXPECT_EQ(event.pair, PairKind::real_virtual);
    EXPECT_NEAR(event.impulse, 30 * 0.5, 30 * 0.5 * 0.3) << "brings the agent to the robot's speed";
    EXPECT_FALSE(event.undetectable);
  }
  EXPECT_TRUE(contact_reported);
}

TEST(Physics, RealRobotVelocityComesFromOdometryNotCorrections) {
  // Corrections move its pose forward while odometry reports no motion: bodies in contact get no speed from
  // that.
  const auto pushed_speed = [](double twist) {
    Simulation simulation = make(room(20));
    spawn(simulation, agent("rover", AgentKind::robot, 0.52, 0));
    std::vector<LaserRequest> requests;
    double fastest = 0;
    for (int i = 0; i <= 720; ++i) {
      simulation.step(real_at(-0.6 + 0.62 * i / 720, 0, 0, {twist, 0, 0}), requests);
      fastest = std::max(fastest, body(simulation, "rover").velocity.x());
    }
    return fastest;
  };
  EXPECT_GT(pushed_speed(0.5), 0.15);
  EXPECT_LT(pushed_speed(0), 0.05);
}

TEST(Physics, AnObjectFallsWhenItsSupportIsRemoved) {
  for (const bool removed : {true, false}) {
    Physics physics(1.0 / 240);
    physics.add_floor(0);
    const auto at = [](double z) { return Transform<Map, Body>::planar(0, 0, 0, z); };
    const PhysicsHandle lower = physics.add_free(ShapeKind::box, {0.4, 0.4, 0.6}, 10, at(0));
    const PhysicsHandle upper = physics.add_free(ShapeKind::box, {0.4, 0.4, 0.4}, 10, at(0.6));
    // A contact wakes them; then they come to rest on each other and sleep.
    const PhysicsHandle hand = physics.add_kinematic({{-0.1, -0.1}, {0.1, -0.1}, {0.1, 0.1}, {-0.1, 0.1}}, 1);
    physics.suspend(hand, false);
    physics.move_kinematic(hand, Transform<Map, Body>::planar(-0.301, 0, 0), {0, 0, 0}, {0, 0, 0});
    for (int i = 0; i < 120; ++i) physics.step();
    physics.suspend(hand, true);
    for (int i = 0; i < 1200; ++i) physics.step();
    EXPECT_NEAR(physics.state(upper).T_map_body.translation().z(), 0.6, 0.002);
    if (removed) {
      physics.remove(lower);
    } else {
      physics.teleport(lower, Transform<Map, Body>::planar(3, 0, 0));
    }
    for (int i = 0; i < 480; ++i) physics.step();
    EXPECT_NEAR(physics.state(upper).T_map_body.translation().z(), 0, 0.002);
  }
}

TEST(Physics, RestingBodiesAreNotMovedByPassingOnes) {
  Simulation simulation = make(room(8));
  spawn(simulation, agent("crate", AgentKind::box, 0, 0));
  spawn(simulation, agent("barrel", AgentKind::barrel, 0, 1.2));
  AgentDefinition walker = moving("walker", AgentKind::person, -2, 0.66, BehaviourKind::patrol, 1);
  walker.behaviour.waypoints = {{-2, 0.66}, {2, 0.66}};
  spawn(simulation, walker);
  double nearest = 10;
  for (int i = 0; i < 240 * 8; ++i) {
    run(simulation, 1.0 / 240);
    nearest = std::min(nearest, simulation.pose_of("walker")->translation().norm());
    // Bodies nearby are awake: contacts hold them to less than a laser's resolution.
    ASSERT_LT(simulation.pose_of("crate")->translation().norm(), 1e-3) << "step " << i;
    ASSERT_LT((simulation.pose_of("barrel")->translation() - Eigen::Vector3d(0, 1.2, 0)).norm(), 1e-3)
        << "step " << i;
  }
  EXPECT_LT(nearest, 0.8) << "it did pass";
  for (const Event& event : simulation.take_events())
    EXPECT_TRUE(event.kind != EventKind::movement_started || event.subject == "walker") << event.subject;
}

TEST(Physics, BadOptionsAndModelsAreRefusedByName) {
  SemanticModel model = room(5);
  model.entities[2].size.x() = -1;
  const auto refused = Simulation::create({}, model, robot(), kStart);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, testing::HasSubstr("wall 2"));

  SimulationOptions options;
  options.rate = 0;
  EXPECT_FALSE(Simulation::create(options, {}, robot(), kStart).ok());
  RobotDescription flat = robot();
  flat.footprint = {{0, 0}, {1, 0}};
  EXPECT_FALSE(Simulation::create({}, {}, flat, kStart).ok());
}

}  // namespace
}  // namespace parhelion::simulation
