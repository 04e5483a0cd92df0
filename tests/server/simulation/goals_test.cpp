// Agents that go to a goal, follow, flee, block the path and step aside.
#include "server/simulation/building/planar.hpp"
#include "server/simulation/virtual_contact.hpp"
#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

/// Two rooms side by side, 6 m each; a gap of 1 m in the wall between them, at y = -2.
SemanticModel rooms_with_a_goal(bool closed = false) {
  SemanticModel model = room(12);
  model.entities.push_back(model_box("between 1", EntityLabel::wall, {0, 2.25, 1.25}, {0.1, 7.5, 2.5}));
  model.entities.push_back(model_box("between 2", EntityLabel::wall, {0, -4.25, 1.25}, {0.1, 3.5, 2.5}));
  if (closed) model.entities.push_back(model_box("door 1", EntityLabel::door, {0, -2, 1}, {0.04, 1, 2}));
  return model;
}

AgentDefinition targeting(const std::string& name, AgentKind kind, double x, double y,
                          BehaviourKind behaviour, double distance, const std::string& target = {}) {
  AgentDefinition definition = moving(name, kind, x, y, behaviour, 0.8);
  definition.behaviour.distance = distance;
  definition.behaviour.target = target;
  return definition;
}

Eigen::Vector2d goal_place(const Simulation& simulation, const std::string& name) {
  return body(simulation, name).T_map_body.translation().head<2>();
}

const Event* find_agent(const std::vector<Event>& events, EventKind kind) {
  for (const Event& event : events) {
    if (event.kind == kind) return &event;
  }
  return nullptr;
}

TEST(Goals, GoesThroughTheGapAndReportsEachWaypoint) {
  for (const AgentKind kind : {AgentKind::robot, AgentKind::person}) {
    Simulation simulation = make(rooms_with_a_goal());
    AgentDefinition runner = moving("runner", kind, -4, 4, BehaviourKind::go, 0.8);
    runner.behaviour.waypoints = {{4, 4}, {-4, -4}};
    spawn(simulation, runner);
    run(simulation, 75);
    EXPECT_LT((goal_place(simulation, "runner") - Eigen::Vector2d(-4, -4)).norm(), 0.35) << to_string(kind);
    const auto events = simulation.take_events();
    EXPECT_EQ(count(events, EventKind::goal_reached), 2U);
    EXPECT_EQ(count(events, EventKind::contact_started), 0U);
    ASSERT_TRUE(find_agent(events, EventKind::goal_reached));
    EXPECT_EQ(find_agent(events, EventKind::goal_reached)->value, 1);
  }
}

TEST(Goals, ReportsTheClosedDoorThatBlocksAGoal) {
  Simulation simulation = make(rooms_with_a_goal(true));
  AgentDefinition runner = moving("runner", AgentKind::robot, -4, 4, BehaviourKind::go, 0.8);
  runner.behaviour.waypoints = {{4, 4}};
  spawn(simulation, runner);
  run(simulation, 20);
  const auto events = simulation.take_events();
  ASSERT_EQ(count(events, EventKind::goal_unreachable), 1U) << "reported once";
  EXPECT_NE(find_agent(events, EventKind::goal_unreachable)->text.find("door 1"), std::string::npos);
  EXPECT_LT(goal_place(simulation, "runner").x(), 0);
}

TEST(Goals, AGoalInsideAWallIsRefused) {
  Simulation simulation = make(rooms_with_a_goal());
  AgentDefinition runner = moving("runner", AgentKind::robot, -4, 4, BehaviourKind::go, 0.8);
  runner.behaviour.waypoints = {{0, 2}};
  const Status status = simulation.spawn(runner, std::nullopt);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("next to 'between 1'"), std::string::npos) << status.error().message;
  runner.behaviour = {};
  spawn(simulation, runner);
  AgentBehaviour command{.agent = "runner"};
  command.behaviour.kind = BehaviourKind::follow;
  command.behaviour.target = "runer";
  const Status unknown = simulation.command(command, std::nullopt);
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("did you mean 'runner'"), std::string::npos);
}

TEST(Goals, GoesAroundACrateInItsPath) {
  Simulation simulation = make(room(12));
  AgentDefinition runner = moving("runner", AgentKind::robot, -4, 0, BehaviourKind::go, 0.8);
  runner.behaviour.waypoints = {{4, 0}};
  spawn(simulation, runner);
  run(simulation, 1);
  AgentDefinition crate = agent("crate", AgentKind::box, 0.5, 0);
  crate.size = {0.4, 4, 1};
  spawn(simulation, crate);
  run(simulation, 40);
  EXPECT_LT((goal_place(simulation, "runner") - Eigen::Vector2d(4, 0)).norm(), 0.35);
  EXPECT_EQ(count(simulation.take_events(), EventKind::contact_started), 0U);
}

TEST(Goals, FollowsThroughTheGapAndKeepsItsDistance) {
  Simulation simulation = make(rooms_with_a_goal());
  AgentDefinition guide = moving("guide", AgentKind::person, -3, 3, BehaviourKind::go, 0.5);
  guide.behaviour.waypoints = {{4, 4}};
  spawn(simulation, guide);
  spawn(simulation, targeting("dog", AgentKind::robot, -5, 3, BehaviourKind::follow, 1.0, "guide"));
  std::vector<LaserRequest> requests;
  double nearest = 10;
  for (int i = 0; i < 240 * 60; ++i) {
    simulation.step({}, requests);
    if (i % 24 == 0)
      nearest = std::min(nearest, (goal_place(simulation, "dog") - goal_place(simulation, "guide")).norm());
  }
  const double end = (goal_place(simulation, "dog") - goal_place(simulation, "guide")).norm();
  EXPECT_LT(end, 1.0 + 0.65 + 0.5);
  EXPECT_GT(nearest, 1.0) << "between outlines 1 m, less a little";
  EXPECT_EQ(count(simulation.take_events(), EventKind::contact_started), 0U);
}

TEST(Goals, FleesFromNearbyObjectsAndThenStops) {
  Simulation simulation = make(room(20));
  spawn(simulation, targeting("shy", AgentKind::person, 2, 0, BehaviourKind::flee, 2.5), real_at(-8, 0));
  run(simulation, 5, real_at(-8, 0));
  EXPECT_LT((goal_place(simulation, "shy") - Eigen::Vector2d(2, 0)).norm(), 0.01) << "nothing is near";
  std::vector<LaserRequest> requests;
  double nearest = 10;
  for (int i = 0; i < 240 * 40; ++i) {
    const double x = -3 + 0.2 * i / 240;
    simulation.step(real_at(x, 0, 0, {0.2, 0, 0}), requests);
    if (i > 240 * 10)
      nearest = std::min(nearest, (goal_place(simulation, "shy") - Eigen::Vector2d(x, 0)).norm());
  }
  EXPECT_GT(nearest, 2.0);
  EXPECT_EQ(count(simulation.take_events(), EventKind::contact_started), 0U);
}

/// Area that the robot cannot avoid: its footprint swept until it stands.
bool inside_stopping_distance(const Simulation& simulation, const std::string& name,
                              const RealRobotState& real) {
  const Footprint person = make_disc(goal_place(simulation, name), 0.25);
  const RobotLimits limits = robot().limits;
  const double v = std::abs(real.twist.vx),
               braking_distance = v * limits.reaction_time + v * v / (2 * limits.deceleration);
  for (double s = 0; s <= braking_distance + 1e-9; s += 0.02) {
    Footprint placed;
    const double t = v > 0 ? s / v : 0;
    place(make_polygon(robot().footprint), advance(planar_pose(real.T_map_base), real.twist, t), placed);
    if (signed_distance(placed, person) < 0) return true;
  }
  return false;
}

// The trainee drives along corridors and curves, limited by MR_CMD; the blocker must block the path, but
// never within the stopping distance.
TEST(Goals, BlocksThePathAndStaysOutsideTheStoppingDistance) {
  const ContactLimits contact;
  for (const double turn : {0.0, 0.15, -0.25}) {
    Simulation simulation = make(room(60));
    Pose2 pose{-8, 0, 0};
    Twist2 twist;
    spawn(simulation, targeting("guard", AgentKind::person, -2, 6, BehaviourKind::block, 1.0),
          real_at(pose.x, pose.y));
    std::vector<LaserRequest> requests;
    std::size_t inside = 0, held = 0;
    for (int i = 0; i < 240 * 40; ++i) {
      const Twist2 asked{0.6, 0, turn * 0.6};
      if (i % 12 == 0) {
        const auto clearance = simulation.clearance(Transform<Map, Base>::planar(pose.x, pose.y, pose.yaw),
                                                    asked, contact_lookahead(contact, robot(), asked));
        const double scale = contact_scale(contact, robot().limits, clearance.distance, 0.7);
        held += scale < 1;
        twist = {scale * asked.vx, 0, scale * asked.wz};
      }
      pose = advance(pose, twist, 1.0 / 240);
      const RealRobotState real = real_at(pose.x, pose.y, pose.yaw, twist);
      simulation.step(real, requests);
      inside += inside_stopping_distance(simulation, "guard", real);
    }
    EXPECT_EQ(inside, 0U) << "turn " << turn;
    EXPECT_GT(held, 10U) << "it stood in the way at least once, turn " << turn;
    EXPECT_EQ(count(simulation.take_events(), EventKind::contact_started), 0U);
  }
}

TEST(Goals, OnlyYieldingAgentsStepAside) {
  for (const bool yields : {true, false}) {
    Simulation simulation = make(room(20));
    AgentDefinition visitor = agent("visitor", AgentKind::person, 2, 0.1);
    visitor.behaviour.yields = yields;
    spawn(simulation, visitor, real_at(-4, 0));
    std::vector<LaserRequest> requests;
    for (int i = 0; i < 240 * 16; ++i)
      simulation.step(real_at(-4 + 0.5 * i / 240, 0, 0, {0.5, 0, 0}), requests);
    const auto events = simulation.take_events();
    EXPECT_EQ(count(events, EventKind::contact_started) > 0, !yields);
    if (yields) {
      EXPECT_GT(std::abs(goal_place(simulation, "visitor").y()), 0.4);
    }
  }
}

TEST(Goals, ManyAgentsWithGoalsKeepStepsShort) {
  Simulation simulation = make(rooms_with_a_goal());
  for (int i = 0; i < 12; ++i) {
    AgentDefinition runner = moving("r" + std::to_string(i), AgentKind::person, -5 + 0.9 * (i % 4),
                                    1 + 1.2 * (i / 4), BehaviourKind::go);
    runner.behaviour.waypoints = {{1.5 + 0.9 * (i % 4), 1 + 1.2 * (i / 4)}};
    runner.behaviour.speed = 0.8;
    spawn(simulation, runner);
  }
  run(simulation, 150);
  EXPECT_GE(count(simulation.take_events(), EventKind::goal_reached), 11U);
}

}  // namespace
}  // namespace parhelion::simulation
