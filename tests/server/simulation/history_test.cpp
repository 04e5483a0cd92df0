#include <random>

#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

const BodyState* find(const WorldSnapshot& world, BodyId id) {
  for (const BodyState& state : world.bodies) {
    if (state.id == id) return &state;
  }
  return nullptr;
}

TEST(History, StatesAreInterpolatedBetweenSteps) {
  Simulation simulation = make(room(10));
  spawn(simulation, moving("rover", AgentKind::robot, 0, 0, BehaviourKind::teleop));
  spawn(simulation, moving("walker", AgentKind::person, 0, 2, BehaviourKind::wander));
  AgentDefinition tall = agent("tall", AgentKind::box, 0.8, 0);
  tall.size = {0.2, 0.2, 1.5};
  spawn(simulation, tall);
  std::vector<WorldSnapshot> steps;  // reference implementation: all states, kept
  std::vector<LaserRequest> requests;
  for (int i = 0; i < 960; ++i) {
    simulation.teleop("rover", {0.7, 0, 0.4});
    simulation.step(real_at(-2, -2 + 0.001 * i, 0.01 * i, {0, 0.24, 2.4}), requests);
    ASSERT_TRUE(simulation.at(simulation.now(), steps.emplace_back()));
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  WorldSnapshot world;
  for (int i = 0; i < 2000; ++i) {
    const auto k = static_cast<std::size_t>(500 + 458 * unit(random));
    const SimulationTime t =
        steps[k].stamp + nanoseconds(static_cast<std::int64_t>(4'166'000 * unit(random)));
    ASSERT_TRUE(simulation.at(t, world));
    ASSERT_EQ(world.bodies.size(), steps[k].bodies.size());
    const double s = (t - steps[k].stamp).seconds() / (steps[k + 1].stamp - steps[k].stamp).seconds();
    for (std::size_t b = 0; b < world.bodies.size(); ++b) {
      const BodyState &from = steps[k].bodies[b], &to = steps[k + 1].bodies[b];
      const Eigen::Vector3d p = (1 - s) * from.T_map_body.translation() + s * to.T_map_body.translation();
      EXPECT_LT((world.bodies[b].T_map_body.translation() - p).norm(), 1e-12);
      const Eigen::AngleAxisd turn(from.T_map_body.rotation().transpose() * to.T_map_body.rotation());
      const Eigen::Matrix3d R =
          from.T_map_body.rotation() * Eigen::AngleAxisd(s * turn.angle(), turn.axis()).toRotationMatrix();
      EXPECT_LT((world.bodies[b].T_map_body.rotation() - R).norm(), 1e-7);
    }
  }
}

TEST(History, AnExactStampGivesThatStepsStateBitForBit) {
  Simulation simulation = make(room(10));
  spawn(simulation, moving("walker", AgentKind::person, 0, 2, BehaviourKind::wander));
  WorldSnapshot then, later;
  run(simulation, 1);
  ASSERT_TRUE(simulation.at(simulation.now(), then));
  const SimulationTime t = simulation.now();
  run(simulation, 1);
  ASSERT_TRUE(simulation.at(t, later));
  ASSERT_EQ(then.bodies.size(), later.bodies.size());
  EXPECT_EQ(then.step, later.step);
  for (std::size_t b = 0; b < then.bodies.size(); ++b) {
    EXPECT_EQ(then.bodies[b].T_map_body.isometry().matrix(), later.bodies[b].T_map_body.isometry().matrix());
  }
}

TEST(History, ExtrapolatesAtMostOneStep) {
  Simulation simulation = make(room(20));
  spawn(simulation, moving("rover", AgentKind::robot, -5, 0, BehaviourKind::teleop));
  drive(simulation, "rover", {0.5, 0, 0}, 2);
  const BodyId id = body(simulation, "rover", "chassis").id;
  const double x = body(simulation, "rover", "chassis").T_map_body.translation().x();
  WorldSnapshot world;
  ASSERT_TRUE(simulation.at(simulation.now() + milliseconds(4), world));
  EXPECT_NEAR(find(world, id)->T_map_body.translation().x(), x + 0.5 * 0.004, 1e-9);
  EXPECT_TRUE(simulation.at(simulation.next_step(), world));
  EXPECT_FALSE(simulation.at(simulation.next_step() + nanoseconds(1), world));
  EXPECT_FALSE(simulation.at(simulation.now() - seconds(2.01), world));
  EXPECT_TRUE(simulation.at(simulation.now() - seconds(1.99), world));
}

TEST(History, AnAgentExistsFromItsFirstStepUntilRemoval) {
  Simulation simulation = make(room(10));
  run(simulation, 0.5);
  const SimulationTime before = simulation.now(), first = simulation.next_step();
  spawn(simulation, agent("crate", AgentKind::box, 1, 1));
  run(simulation, 0.5);
  EXPECT_FALSE(has_body(simulation, before, "crate"));
  EXPECT_FALSE(has_body(simulation, first - nanoseconds(1), "crate"));
  EXPECT_TRUE(has_body(simulation, first, "crate"));

  const SimulationTime last = simulation.now(), gone = simulation.next_step();
  ASSERT_TRUE(simulation.command(AgentRemove{.agent = "crate"}, std::nullopt).ok());
  run(simulation, 0.5);
  EXPECT_TRUE(has_body(simulation, last, "crate"));
  EXPECT_TRUE(has_body(simulation, gone - nanoseconds(1), "crate"));
  EXPECT_FALSE(has_body(simulation, gone, "crate"));
}

TEST(History, NothingIsInterpolatedOverATeleport) {
  Simulation simulation = make(room(10));
  spawn(simulation, agent("crate", AgentKind::box, -3, 0));
  run(simulation, 0.5);
  const BodyState then = body(simulation, "crate");
  const SimulationTime before = simulation.now(), after = simulation.next_step();
  const AgentMove command{.agent = "crate", .T_map_base = Transform<Map, Base>::planar(3, 0, 0)};
  ASSERT_TRUE(simulation.command(command, std::nullopt).ok());
  run(simulation, 0.5);
  WorldSnapshot world;
  ASSERT_TRUE(simulation.at(before + milliseconds(2), world));
  EXPECT_EQ(find(world, then.id)->T_map_body.translation().x(), -3);
  EXPECT_EQ(find(world, then.id)->epoch, then.epoch);
  ASSERT_TRUE(simulation.at(after, world));
  EXPECT_NEAR(find(world, then.id)->T_map_body.translation().x(), 3, 1e-9);
  EXPECT_EQ(find(world, then.id)->epoch, then.epoch + 1);
}

TEST(History, ARelocalizationCausesNoVelocityAndNoContacts) {
  Simulation simulation = make(room(20));
  spawn(simulation, agent("rover", AgentKind::robot, 3, 0));
  std::vector<LaserRequest> requests;
  for (int i = 0; i < 100; ++i) simulation.step(real_at(0, 0), requests);
  const BodyState before = body(simulation, "pioneer");
  RealRobotState jumped = real_at(2.9, 0, 0, {0.5, 0, 0});
  jumped.relocalized = true;
  jumped.injection_live = false;
  simulation.step(jumped, requests);
  const BodyState after = body(simulation, "pioneer");
  EXPECT_EQ(after.epoch, before.epoch + 1);
  EXPECT_EQ(after.velocity.norm(), 0);
  EXPECT_EQ(count(simulation.take_events(), EventKind::contact_started), 0U);
  EXPECT_NEAR(body(simulation, "rover").T_map_body.translation().x(), 3, 1e-9);
}

TEST(History, WithoutAPoseTheRealRobotIsNotInTheWorld) {
  Simulation simulation = make(room(20));
  run(simulation, 0.1, real_at(0, 0));
  EXPECT_TRUE(has_body(simulation, simulation.now(), "pioneer"));
  run(simulation, 0.1, std::nullopt);
  EXPECT_FALSE(has_body(simulation, simulation.now(), "pioneer"));
}

TEST(History, BodiesAscendById) {
  Simulation simulation = make(room(10));
  spawn(simulation, agent("b", AgentKind::person, 0, 2));
  spawn(simulation, agent("a", AgentKind::robot, 0, 0));
  run(simulation, 0.1, real_at(2, 2));
  WorldSnapshot world;
  ASSERT_TRUE(simulation.at(simulation.now(), world));
  for (std::size_t i = 1; i < world.bodies.size(); ++i) EXPECT_LT(world.bodies[i - 1].id, world.bodies[i].id);
  EXPECT_EQ(world.bodies.size(), world.scene->bodies.size());
  for (std::size_t i = 0; i < world.bodies.size(); ++i)
    EXPECT_EQ(world.bodies[i].id, world.scene->bodies[i]->id);
}

}  // namespace
}  // namespace parhelion::simulation
