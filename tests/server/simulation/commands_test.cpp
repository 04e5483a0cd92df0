#include <gmock/gmock.h>

#include <limits>

#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;
using testing::HasSubstr;

std::string refusal(Simulation& simulation, const AgentDefinition& definition,
                    const std::optional<RealRobotState>& real = std::nullopt) {
  const Status status = simulation.spawn(definition, real);
  return status.ok() ? "(not refused)" : status.error().message;
}

/// The position suggested by a refusal.
Eigen::Vector2d suggested(const std::string& message) {
  const auto at = message.find("nearest free place is (");
  if (at == std::string::npos) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  Eigen::Vector2d p;
  EXPECT_EQ(std::sscanf(message.c_str() + at, "nearest free place is (%lf, %lf)", &p.x(), &p.y()), 2);
  return p;
}

TEST(Commands, AnAgentOnTheRealRobotIsRefusedWithAFreePlace) {
  Simulation simulation = make(room(10));
  const RealRobotState real = real_at(0, 0);
  const std::string message = refusal(simulation, agent("crate", AgentKind::box, 0.1, 0), real);
  EXPECT_THAT(message, HasSubstr("crate"));
  EXPECT_THAT(message, HasSubstr("on a trainee's robot"));
  const Eigen::Vector2d p = suggested(message);
  EXPECT_LT(p.norm(), 1.0);
  EXPECT_TRUE(simulation.spawn(agent("crate", AgentKind::box, p.x(), p.y()), real).ok());
}

/// A room of 6 m with a partition along x = 1 m that leaves no gap, or one of 1 m at its upper end.
SemanticModel divided_room(bool gap) {
  SemanticModel model = room(6);
  const double top = gap ? 2 : 3;
  model.entities.push_back(
      model_box("partition", EntityLabel::wall, {1, (top - 3) / 2, 1.25}, {0.1, top + 3, 2.5}));
  return model;
}

TEST(Commands, TheNearestFreePlaceIsNotBehindAWall) {
  // The robot at x = 0.4 m and its margin reach the partition: the nearest free place in the plane is behind.
  Simulation simulation = make(divided_room(false));
  const RealRobotState real = real_at(0.4, 0);
  const Eigen::Vector2d p = suggested(refusal(simulation, agent("c", AgentKind::box, 0.85, 0), real));
  EXPECT_LT(p.x(), 0.95) << "behind the partition";
  EXPECT_TRUE(simulation.spawn(agent("c", AgentKind::box, p.x(), p.y()), real).ok());
}

TEST(Commands, TheNearestFreePlaceMayLieAroundTheEndOfAWall) {
  // The rest of the near side is full.
  Simulation simulation = make(divided_room(true));
  std::vector<RealObstacle> full;
  for (double x = -2.9; x < 1; x += 0.3) {
    for (double y = -2.9; y < 3; y += 0.3) full.push_back({{x, y}, 0.3});
  }
  simulation.set_real_obstacles(full);
  const Eigen::Vector2d p = suggested(refusal(simulation, agent("c", AgentKind::box, 0.5, 0)));
  EXPECT_GT(p.x(), 1);
  Simulation closed = make(divided_room(false));
  closed.set_real_obstacles(full);
  EXPECT_THAT(refusal(closed, agent("c", AgentKind::box, 0.5, 0)), HasSubstr("no free place within 6.00 m"));
}

TEST(Commands, FromInsideAWallEitherSideIsNear) {
  Simulation simulation = make(divided_room(false));
  for (const double x : {0.97, 1.03}) {
    const Eigen::Vector2d p = suggested(refusal(simulation, agent("c", AgentKind::box, x, 0)));
    EXPECT_LT(std::abs(p.x() - x), 0.5);
  }
}

TEST(Commands, StoppingDistanceIsAheadAndGrowsWithSpeed) {
  // v^2 / (2 a) + v r = 1 / 2 + 0.2 m for 1 m/s, a = 1, r = 0.2: up to 0.25 + 0.7 + 0.15 m in front.
  const RealRobotState fast = real_at(0, 0, 0, {1, 0, 0});
  Simulation simulation = make(room(10));
  EXPECT_THAT(refusal(simulation, agent("a", AgentKind::box, 1.25, 0), fast), HasSubstr("stopping distance"));
  EXPECT_TRUE(simulation.spawn(agent("a", AgentKind::box, 1.32, 0), fast).ok());
  EXPECT_TRUE(simulation.spawn(agent("b", AgentKind::box, -0.7, 0), fast).ok()) << "behind it there is room";
  EXPECT_TRUE(simulation.spawn(agent("c", AgentKind::box, 0.7, 1.0), real_at(0, 0)).ok());
}

TEST(Commands, WallsOtherAgentsAndUnexplainedReturnsAreObstacles) {
  Simulation simulation = make(room(6));
  EXPECT_THAT(refusal(simulation, agent("crate", AgentKind::box, 3.05, 0)), HasSubstr("'wall 1'"));
  spawn(simulation, agent("crate", AgentKind::box, 0, 0));
  EXPECT_THAT(refusal(simulation, agent("rover", AgentKind::robot, 0.3, 0)), HasSubstr("agent 'crate'"));
  simulation.set_real_obstacles({{{2, 2}, 0.3}});
  EXPECT_THAT(refusal(simulation, agent("rover", AgentKind::robot, 2, 2)), HasSubstr("does not explain"));
}

TEST(Commands, APlaceOutsideTheSiteIsRefusedWithTheBounds) {
  Simulation simulation = make(room(6));
  const std::string message = refusal(simulation, agent("walker", AgentKind::person, 500, 0));
  EXPECT_THAT(message, HasSubstr("(500.00, 0.00) is far outside the site"));
  EXPECT_THAT(message, HasSubstr("from (-3.50, -3.50) to (3.50, 3.50)"));
  EXPECT_EQ(refusal(simulation, agent("walker", AgentKind::person, 30, 0)), "(not refused)") << "the yard";
  const Status moved = simulation.command(
      AgentMove{.agent = "walker", .T_map_base = Transform<Map, Base>::planar(0, -54, 0)}, std::nullopt);
  ASSERT_FALSE(moved.ok());
  EXPECT_THAT(moved.error().message, HasSubstr("far outside the site"));
  AgentDefinition sent = moving("runner", AgentKind::person, 1, 1, BehaviourKind::patrol);
  sent.behaviour.waypoints = {{0, 1}, {0, 200}};
  EXPECT_THAT(refusal(simulation, sent), HasSubstr("its waypoint (0.00, 200.00) is far outside the site"));
  Simulation open = make();
  EXPECT_EQ(refusal(open, agent("walker", AgentKind::person, 500, 0)), "(not refused)")
      << "a model without anything has no bounds";
}

TEST(Commands, ObjectsAboveAnAgentDoNotBlockIt) {
  SemanticModel model = room(6);
  model.entities.push_back(model_box("lintel", EntityLabel::unknown, {0, 0, 2.2}, {2, 0.3, 0.4}));
  model.entities.push_back(model_box("ceiling", EntityLabel::ceiling, {0, 0, 2.6}, {6, 6, 0.1}));
  Simulation simulation = make(model);
  EXPECT_TRUE(simulation.spawn(agent("crate", AgentKind::box, 0, 0), std::nullopt).ok());
}

TEST(Commands, CommandsToNonAgentsAreRefused) {
  Simulation simulation = make(room(6));
  EXPECT_THAT(refusal(simulation, agent("", AgentKind::box, 0, 0)), HasSubstr("expected 1 to 32"));
  EXPECT_THAT(refusal(simulation, agent("a b", AgentKind::box, 0, 0)), HasSubstr("a b"));
  EXPECT_THAT(refusal(simulation, agent("pioneer", AgentKind::box, 1, 0)), HasSubstr("real robot's name"));
  AgentDefinition flat = agent("flat", AgentKind::box, 0, 0);
  flat.size.z() = 0;
  EXPECT_THAT(refusal(simulation, flat), HasSubstr("size"));
  AgentDefinition oval = agent("oval", AgentKind::barrel, 0, 0);
  oval.size = {0.4, 0.6, 0.9};
  EXPECT_THAT(refusal(simulation, oval), HasSubstr("round"));
  EXPECT_THAT(refusal(simulation, agent("far", AgentKind::box, std::nan(""), 0)), HasSubstr("not finite"));
  AgentDefinition driving = agent("crate", AgentKind::box, 0, 0);
  driving.behaviour.kind = BehaviourKind::wander;
  EXPECT_THAT(refusal(simulation, driving), HasSubstr("cannot wander"));
  AgentDefinition aimless = agent("rover", AgentKind::robot, 0, 0);
  aimless.behaviour.kind = BehaviourKind::patrol;
  EXPECT_THAT(refusal(simulation, aimless), HasSubstr("waypoint"));
  aimless.behaviour.kind = BehaviourKind::wander;
  aimless.behaviour.speed = -1;
  EXPECT_THAT(refusal(simulation, aimless), HasSubstr("speed"));
  AgentDefinition blind = agent("rover", AgentKind::robot, 0, 0);
  blind.laser = "no-such-preset";
  EXPECT_THAT(refusal(simulation, blind), HasSubstr("no-such-preset"));
  EXPECT_EQ(simulation.take_events().size(), 0U);
}

TEST(Commands, AnUnknownNameIsRefusedWithTheNearestOne) {
  Simulation simulation = make(room(6));
  spawn(simulation, agent("rover_1", AgentKind::robot, 0, 0));
  spawn(simulation, agent("walker", AgentKind::person, 2, 0));
  const Status status = simulation.command(AgentRemove{.agent = "rovr_1"}, std::nullopt);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("did you mean 'rover_1'"));
}

TEST(Commands, AnAgentThatFollowsNobodyIsNotSpawned) {
  Simulation simulation = make(room(6));
  spawn(simulation, agent("walker", AgentKind::person, 2, 0));
  AgentDefinition chaser = moving("chaser", AgentKind::person, 0, 1, BehaviourKind::follow);
  chaser.behaviour.target = "walkr";
  const Status status = simulation.command(AgentSpawn{.agent = chaser}, std::nullopt);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("did you mean 'walker'"));
  chaser.behaviour.target = "walker";
  EXPECT_TRUE(simulation.command(AgentSpawn{.agent = chaser}, std::nullopt));
}

TEST(Commands, EachCommandGivesAnEventWithItsRequest) {
  Simulation simulation = make(room(8));
  const std::vector<AgentCommand> commands{
      AgentSpawn{.request = 41, .agent = agent("rover", AgentKind::robot, 0, 0)},
      AgentMove{.request = 42, .agent = "rover", .T_map_base = Transform<Map, Base>::planar(2, 1, 0)},
      AgentRemove{.request = 43, .agent = "rover"}};
  for (const AgentCommand& command : commands) ASSERT_TRUE(simulation.command(command, {}).ok());
  const auto events = simulation.take_events();
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].kind, EventKind::agent_spawned);
  EXPECT_EQ(events[1].kind, EventKind::agent_moved);
  EXPECT_EQ(events[2].kind, EventKind::agent_removed);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(events[i].request, 41 + i);
  EXPECT_EQ(events[1].position.x(), 2);
  EXPECT_TRUE(simulation.take_events().empty());
}

TEST(Commands, ARefusedMoveDoesNotMoveTheAgent) {
  Simulation simulation = make(room(8));
  spawn(simulation, agent("rover", AgentKind::robot, 0, 0));
  const AgentMove command{.agent = "rover", .T_map_base = Transform<Map, Base>::planar(4.05, 0, 0)};
  EXPECT_FALSE(simulation.command(command, {}).ok());
  run(simulation, 0.1);
  EXPECT_NEAR(body(simulation, "rover").T_map_body.translation().x(), 0, 1e-9);
}

TEST(Commands, IdsAreNeverReusedAndTheSceneVersionChanges) {
  Simulation simulation = make(room(8));
  spawn(simulation, agent("crate", AgentKind::box, 0, 0));
  run(simulation, 0.1);
  const BodyId first = body(simulation, "crate").id;
  const auto version = simulation.scene()->version;
  ASSERT_TRUE(simulation.command(AgentRemove{.all = true}, {}).ok());
  EXPECT_GT(simulation.scene()->version, version);
  spawn(simulation, agent("crate", AgentKind::box, 0, 0));
  run(simulation, 0.1);
  EXPECT_GT(body(simulation, "crate").id, first);
}

TEST(Commands, AFrozenAgentStopsAndContinuesWhenUnfrozen) {
  Simulation simulation = make(room(20));
  spawn(simulation, moving("rover", AgentKind::robot, 0, 0, BehaviourKind::wander));
  run(simulation, 3);
  ASSERT_TRUE(simulation.command(AgentFreeze{.all = true}, {}).ok());
  run(simulation, 2);
  const Eigen::Vector3d there = body(simulation, "rover").T_map_body.translation();
  run(simulation, 2);
  EXPECT_LT((body(simulation, "rover").T_map_body.translation() - there).norm(), 1e-6);
  ASSERT_TRUE(simulation.command(AgentFreeze{.all = true, .frozen = false}, {}).ok());
  run(simulation, 3);
  EXPECT_GT((body(simulation, "rover").T_map_body.translation() - there).norm(), 0.3);
}

}  // namespace
}  // namespace parhelion::simulation
