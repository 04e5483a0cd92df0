// Shapes looked up by the bodies' names equal those of the simulation.
#include "server/simulation/entity_shapes.hpp"

#include "tests/server/simulation/robots_world.hpp"
#include "tests/server/simulation/worlds.hpp"

namespace parhelion::simulation {
namespace {

bool alike(const std::vector<Shape>& a, const std::vector<Shape>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Shape& x, const Shape& y) {
    return x.kind == y.kind && x.size == y.size &&
           x.T_body_shape.isometry().matrix() == y.T_body_shape.isometry().matrix() &&
           x.material.albedo == y.material.albedo;
  });
}

SemanticModel room_with_door() {
  SemanticModel model = test::room(12);
  model.entities.push_back(test::model_box("door 1", EntityLabel::door, {0, 0, 1}, {0.9, 0.05, 2}));
  return model;
}

std::vector<AgentDefinition> one_of_each_kind() {
  std::vector<AgentDefinition> agents{
      test::agent("carton", AgentKind::box, -5, -5),    test::agent("barrel", AgentKind::barrel, -3, -5),
      test::agent("walker", AgentKind::person, -1, -5), test::agent("machine", AgentKind::robot, 1, -5),
      test::agent("tub", AgentKind::container, 3, -5),  test::agent("wire", AgentKind::cable, 4, 4),
      test::agent("tracks", AgentKind::robot, -4, 4)};
  agents[1].size = {0.5, 0.5, 0.9};
  agents[5].size = {1, 0.03, 0.03};
  agents[6].model = "crawler";
  return agents;
}

AgentSpawn spawn_of(const AgentDefinition& agent, std::uint64_t request) {
  return {.request = request, .agent = agent};
}

Event spawned(const std::string& name, std::uint64_t request) {
  Event event;
  event.kind = EventKind::agent_spawned;
  event.subject = name;
  event.request = request;
  return event;
}

TEST(EntityShapes, MovingBodiesHaveTheShapesOfTheSimulation) {
  const auto crawler = load_robot_model("crawler");
  ASSERT_TRUE(crawler.ok()) << crawler.error().message;
  SimulationOptions options;
  options.robot_models = {std::make_shared<const RobotModel>(*crawler)};
  Scenario scenario;
  scenario.level = 3;
  scenario.agents = one_of_each_kind();
  DoorSettings drawn;
  drawn.name = "door 1";
  drawn.is_virtual = true;
  scenario.doors = options.doors = {drawn};
  const SemanticModel model = room_with_door();
  Simulation simulation = test::make(model, options);
  for (const AgentDefinition& agent : scenario.agents) test::spawn(simulation, agent);
  const EntityShapes shapes(scenario, test::robot(), model, options.robot_models);
  std::size_t seen = 0;
  for (const auto& body : simulation.scene()->bodies) {
    if (body->owner == BodyOwner::building && !body->moves) continue;
    const auto* found = shapes.find(body->entity, body->part);
    ASSERT_NE(found, nullptr) << body->entity << " " << body->part;
    EXPECT_TRUE(alike(*found, body->shapes)) << body->entity << " " << body->part;
    ++seen;
  }
  EXPECT_GT(seen, 30U);
}

TEST(EntityShapes, OnlyCompletedSpawnsCount) {
  EntityShapes shapes({}, test::robot(), {}, {});
  shapes.take(spawn_of(test::agent("late", AgentKind::barrel, 0, 0), 7));
  EXPECT_EQ(shapes.find("late", "barrel"), nullptr);
  shapes.take(spawned("late", 7));
  ASSERT_NE(shapes.find("late", "barrel"), nullptr);

  // The name exists already: the server refuses, and it stays a barrel.
  shapes.take(spawn_of(test::agent("late", AgentKind::box, 0, 0), 8));
  Event refused;
  refused.kind = EventKind::command_refused;
  refused.request = 8;
  shapes.take(refused);
  shapes.take(spawned("late", 8));
  EXPECT_NE(shapes.find("late", "barrel"), nullptr);
  EXPECT_EQ(shapes.find("late", "box"), nullptr);
}

TEST(EntityShapes, UnknownSpawnedEntitiesHaveNoShape) {
  EntityShapes shapes({}, test::robot(), {}, {});
  shapes.take(spawned("stranger", 3));
  EXPECT_EQ(shapes.find("stranger", "box"), nullptr);
  EXPECT_EQ(shapes.definition("stranger"), nullptr);
  EXPECT_NE(shapes.find("pioneer", "base"), nullptr);
}

TEST(EntityShapes, OnlyARobotWithALaserHasALaserMount) {
  Scenario scenario;
  scenario.agents = {test::agent("blind", AgentKind::robot, 0, 0),
                     test::agent("seeing", AgentKind::robot, 2, 0)};
  scenario.agents[1].laser = "lms-200";
  const EntityShapes shapes(scenario, test::robot(), {}, {});
  EXPECT_FALSE(shapes.laser_mount("blind"));
  EXPECT_FALSE(shapes.laser_mount("nobody"));
  EXPECT_TRUE(shapes.laser_mount("seeing"));
}

/// A session may run for days, and agents come and go.
TEST(EntityShapes, OldRemovedAgentsAreForgottenAndNewOnesKept) {
  Scenario scenario;
  scenario.level = 3;
  scenario.agents = {test::agent("first", AgentKind::box, 1, 1)};
  EntityShapes shapes(scenario, {}, test::room(12), {});
  const auto spawn = [&](const std::string& name) {
    shapes.take(spawn_of(test::agent(name, AgentKind::box, 0, 0), 1));
    shapes.take(spawned(name, 1));
  };
  const auto remove = [&](const std::string& name) {
    Event event;
    event.kind = EventKind::agent_removed;
    event.subject = name;
    shapes.take(event);
  };
  remove("first");
  for (const std::string name : {"box_1", "box_2", "box_3"}) spawn(name);
  remove("box_1");
  remove("box_2");
  spawn("box_2");
  for (std::size_t i = 0; i < EntityShapes::kMaxRemoved; ++i) {
    spawn("other_" + std::to_string(i));
    remove("other_" + std::to_string(i));
  }
  EXPECT_EQ(shapes.definition("box_1"), nullptr);
  EXPECT_EQ(shapes.find("box_1", "box"), nullptr);
  for (const std::string name : {"first", "box_2", "box_3", "other_0"})
    EXPECT_NE(shapes.definition(name), nullptr) << name;
}

}  // namespace
}  // namespace parhelion::simulation
