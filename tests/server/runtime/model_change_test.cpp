// A new version of the model replaces the old one at a step, is an input of the log, and is applied by
// replay.
#include <gtest/gtest.h>

#include <fstream>

#include "server/runtime/replay.hpp"
#include "server/tick/tick.hpp"
#include "tests/file_bytes.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::runtime {
namespace {

/// The room with its wall ahead (x = 5) moved to `x`, and a new block in it.
SemanticModel room_with_wall_at(double x) {
  SemanticModel model = test::room();
  model.entities[3] = test::wall("wall 4", x, 0, std::numbers::pi / 2, 7.8);
  ModelEntity block = test::wall("block 1", -3, -2, 0, 0.5);
  block.label = EntityLabel::unknown;
  model.entities.push_back(block);
  return model;
}

Message new_model(std::int64_t arrival_us, const SemanticModel& model, std::uint64_t version) {
  return test::message(channel::kMrModel, arrival_us,
                       ModelVersion{SensorTime::from_utime(arrival_us), version, to_yaml(model)});
}

tick::Configuration mapping_configuration(std::vector<AgentDefinition> agents) {
  tick::Configuration configuration = test::configuration(std::move(agents));
  configuration.scenario.mapping = true;
  return configuration;
}

class ModelChangeTest : public testing::Test {
 protected:
  void start(const tick::Configuration& with) {
    configuration_ = with;
    auto made = tick::make_state(configuration_, ArrivalTime::from_utime(test::kStartUs));
    ASSERT_TRUE(made.ok()) << made.error().message;
    state_ = std::move(*made);
  }
  void give(const Message& message) {
    outputs_.clear();
    tick::StageObserver observer;
    tick::tick(configuration_, message, *state_, outputs_, observer);
  }
  int events(EventKind kind) const {
    int count = 0;
    for (const tick::Outputs::Entry& entry : outputs_.entries()) {
      Event event;
      if (entry.channel == channel::kMrEvents && decode(entry.channel, entry.payload, event).ok())
        count += event.kind == kind ? 1 : 0;
    }
    return count;
  }
  /// Range to the building along x from the centre of the room.
  float range_ahead() {
    const float time = 0;
    scan::RangeHit hit;
    const auto T = Transform<Map, Laser>::planar(0, 0, 0, 0.5);
    state_->site.caster.cast_building({T, T}, {0, 0.01F, {&time, 1}}, 30, {&hit, 1});
    return hit.range;
  }

  tick::Configuration configuration_ = test::configuration({});
  std::unique_ptr<tick::State> state_;
  tick::Outputs outputs_;
};

TEST_F(ModelChangeTest, NewModelAppliesToSensorsAndAgentsButNotHistory) {
  start(mapping_configuration({test::agent("robot_1", AgentKind::robot, 2, 0)}));
  EXPECT_NEAR(range_ahead(), 4.95, 1e-4);
  give(test::message(channel::kOdometry, test::kStartUs + 500'000, Odometry{}));
  const SimulationTime before = state_->simulation.now();
  WorldSnapshot old;
  ASSERT_TRUE(state_->simulation.at(before, old));
  const auto old_scene = old.scene;
  give(new_model(test::kStartUs + 600'000, room_with_wall_at(4), 1));
  EXPECT_EQ(events(EventKind::model_changed), 1);
  EXPECT_NEAR(range_ahead(), 3.95, 1e-4);
  ASSERT_NE(state_->site.model, nullptr);
  EXPECT_EQ(state_->site.model->entities.size(), 5U);

  give(test::message(channel::kOdometry, test::kStartUs + 700'000, Odometry{}));
  WorldSnapshot now, then;
  ASSERT_TRUE(state_->simulation.at(state_->simulation.now(), now));
  ASSERT_TRUE(state_->simulation.at(before, then));
  EXPECT_EQ(then.scene, old_scene);
  EXPECT_NE(now.scene, old_scene);
  EXPECT_EQ(now.bodies.size(), then.bodies.size() + 1);
  for (std::size_t i = 1; i < now.bodies.size(); ++i) EXPECT_LT(now.bodies[i - 1].id, now.bodies[i].id);
  for (const WorldSnapshot* world : {&now, &then}) {  // each state has its definition
    auto definition = world->scene->bodies.begin();
    for (const BodyState& body : world->bodies) {
      while (definition != world->scene->bodies.end() && (*definition)->id < body.id) ++definition;
      ASSERT_NE(definition, world->scene->bodies.end());
      EXPECT_EQ((*definition)->id, body.id);
    }
  }
}

TEST_F(ModelChangeTest, AnAgentIsStoppedByTheNewWall) {
  AgentDefinition walker = test::agent("robot_1", AgentKind::robot, 0, 0, BehaviourKind::teleop);
  start(mapping_configuration({walker}));
  give(new_model(test::kStartUs + 10'000, room_with_wall_at(2), 1));
  for (int i = 1; i < 100; ++i) {
    give(test::message("MR_AGENT_robot_1_TELEOP", test::kStartUs + 10'000 + i * 100'000,
                       TwistCommand{SensorTime::from_utime(test::kStartUs), {1.0, 0, 0}}));
  }
  const auto* agent = state_->simulation.find_agent("robot_1");
  ASSERT_NE(agent, nullptr);
  WorldSnapshot world;
  ASSERT_TRUE(state_->simulation.at(state_->simulation.now(), world));
  double farthest = 0;
  for_each_body(world, [&](const BodyDefinition& definition, const BodyState& body) {
    if (definition.entity == "robot_1") farthest = body.T_map_body.translation().x();
  });
  EXPECT_GT(farthest, 0.5);
  EXPECT_LT(farthest, 1.95);
}

TEST_F(ModelChangeTest, AnInvalidVersionIsRefusedAndTheOldOneKept) {
  start(mapping_configuration({test::agent("robot_1", AgentKind::robot, 2, 0)}));
  const auto refused = [&](const Message& message) {
    const auto before = state_->tally.refused_inputs;
    give(message);
    EXPECT_NEAR(range_ahead(), 4.95, 1e-4);
    return state_->tally.refused_inputs == before + 1;
  };
  SemanticModel foreign = room_with_wall_at(4);
  foreign.map_id = "another";
  EXPECT_TRUE(refused(new_model(test::kStartUs + 1000, foreign, 1)));
  EXPECT_NE(state_->tally.last_refusal.find("another"), std::string::npos);
  SemanticModel named = room_with_wall_at(4);
  named.entities[4].name = "robot_1";
  EXPECT_TRUE(refused(new_model(test::kStartUs + 2000, named, 1)));
  Message damaged = new_model(test::kStartUs + 3000, room_with_wall_at(4), 1);
  damaged.payload.resize(damaged.payload.size() / 2);
  EXPECT_TRUE(refused(damaged));
  give(new_model(test::kStartUs + 4000, test::room(), 2));
  EXPECT_TRUE(refused(new_model(test::kStartUs + 5000, room_with_wall_at(4), 2)));
  configuration_.scenario.mapping = false;
  EXPECT_TRUE(refused(new_model(test::kStartUs + 6000, room_with_wall_at(4), 3)));
}

TEST_F(ModelChangeTest, ReplayAppliesModelChangesAndGivesTheSameBytes) {
  const test::TemporaryFolder folder;
  Scenario scenario;
  scenario.name = "synthetic";
  scenario.mapping = true;
  scenario.model = folder / "model.yaml";
  scenario.agents = {test::agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander),
                     test::agent("person_1", AgentKind::person, -3, 1, BehaviourKind::wander)};
  std::ofstream(folder / "model.yaml") << to_yaml(test::room());
  std::ofstream(folder / "scenario.yaml") << to_yaml(scenario);
  const auto first = new_model(test::kStartUs + 1'501'000, room_with_wall_at(4.5), 1);
  const auto second = new_model(test::kStartUs + 3'001'000, room_with_wall_at(4.2), 2);
  test::write_log(folder / "drive.lcm", test::drive(5, {first, second}));
  test::write_log(folder / "plain.lcm", test::drive(5));
  const auto run = [&](const char* log, const char* session, bool with_scenario) {
    ReplayOptions options;
    options.log = folder / log;
    if (with_scenario) options.scenario = folder / "scenario.yaml";
    options.session = folder / session;
    auto report = replay(options);
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return *report;
  };
  const Report once = run("drive.lcm", "a.lcm", true);
  EXPECT_EQ(once.tally.events[static_cast<std::size_t>(EventKind::model_changed)], 2U);
  const Report again = run("a.lcm", "b.lcm", false);
  EXPECT_EQ(again.hash, once.hash);
  EXPECT_EQ(test::bytes_of(folder / "a.lcm"), test::bytes_of(folder / "b.lcm"));
  EXPECT_NE(run("plain.lcm", "c.lcm", true).hash, once.hash) << "the models make a difference";
}

}  // namespace
}  // namespace parhelion::runtime
