// A scenario's scripts: triggered by time, events and proximity, and the same in replay.
#include "server/tick/scripts.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "server/runtime/replay.hpp"
#include "tests/long_run.hpp"
#include "tests/server/tick/tick_fixture.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::runtime {
namespace {

constexpr SimulationTime kStart{1'000'000'000};

Script on_event(const std::string& name, EventKind kind, const std::string& subject = {},
                const std::string& object = {}) {
  Script script;
  script.name = name;
  script.when.kind = ScriptTrigger::Kind::event;
  script.when.event = kind;
  script.when.subject = subject;
  script.when.object = object;
  return script;
}

Script at_time(const std::string& name, double time, bool repeat = false) {
  Script script;
  script.name = name;
  script.when.time = time;
  script.repeat = repeat;
  return script;
}

Script near(const std::string& name, const std::string& object, double distance, bool repeat = false) {
  Script script;
  script.name = name;
  script.when = {ScriptTrigger::Kind::near, 0, EventKind::agent_spawned, kTrainee, object, distance};
  script.repeat = repeat;
  return script;
}

Event happened(EventKind kind, double t, const std::string& subject, const std::string& object = {}) {
  Event event;
  event.kind = kind;
  event.stamp = kStart + seconds(t);
  event.subject = subject;
  event.object = object;
  return event;
}

std::optional<Eigen::Vector3d> nobody(const std::string&) { return std::nullopt; }

/// Names of the scripts due at t.
std::vector<std::string> due(tick::Scripts& scripts, double t,
                             const tick::Scripts::PlaceOf& place_of = nobody) {
  scripts.update(kStart + seconds(t), place_of);
  std::vector<std::string> names;
  for (const tick::Scripts::Due& each : scripts.take_due(kStart + seconds(t)))
    names.push_back(each.script->name);
  return names;
}

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Scripts, StartAtTheirTimeOnceOrRepeatedly) {
  tick::Scripts scripts({at_time("once", 2), at_time("each 1.5 s", 1.5, true)}, {"robot"}, kStart);
  EXPECT_THAT(due(scripts, 1.4), IsEmpty());
  EXPECT_THAT(due(scripts, 1.5), ElementsAre("each 1.5 s"));
  EXPECT_THAT(due(scripts, 2.1), ElementsAre("once"));
  EXPECT_THAT(due(scripts, 3), ElementsAre("each 1.5 s"));
  EXPECT_THAT(due(scripts, 10), ElementsAre("each 1.5 s")) << "what a pause skipped is not made up for";
  EXPECT_THAT(due(scripts, 10.4), IsEmpty());
  EXPECT_THAT(due(scripts, 10.5), ElementsAre("each 1.5 s"));
}

TEST(Scripts, MatchTheTraineeByAnyOfItsNamesAndNoOtherRobot) {
  tick::Scripts scripts({on_event("door", EventKind::door_space_left, kTrainee, "door 2")},
                        {"rover", "pupil"}, kStart);
  scripts.handle(happened(EventKind::door_space_left, 1, "person_1", "door 2"));
  scripts.handle(happened(EventKind::door_space_left, 1, "rover", "door 3"));
  scripts.handle(happened(EventKind::door_space_entered, 1, "rover", "door 2"));
  EXPECT_THAT(due(scripts, 1), IsEmpty());
  scripts.handle(happened(EventKind::door_space_left, 2, "pupil", "door 2"));
  EXPECT_THAT(due(scripts, 2), ElementsAre("door"));
  scripts.handle(happened(EventKind::door_space_left, 3, "rover", "door 2"));
  EXPECT_THAT(due(scripts, 3), IsEmpty()) << "it runs once";
}

TEST(Scripts, WaitForTheirDelayAndRunInTimeOrder) {
  Script late = on_event("late", EventKind::agent_spawned), soon = on_event("soon", EventKind::agent_spawned);
  late.after = 0.5;
  soon.after = 0.2;
  tick::Scripts scripts({late, soon}, {}, kStart);
  scripts.handle(happened(EventKind::agent_spawned, 1, "a"));
  EXPECT_THAT(due(scripts, 1.19), IsEmpty());
  EXPECT_THAT(due(scripts, 2), ElementsAre("soon", "late"));
}

TEST(Scripts, CanBeStartedByNameAgain) {
  Script late = on_event("late", EventKind::agent_spawned);
  late.after = 0.5;
  tick::Scripts scripts({at_time("once", 1), late}, {}, kStart);
  EXPECT_THAT(due(scripts, 1), ElementsAre("once"));
  ASSERT_TRUE(scripts.trigger("once", kStart + seconds(2)));
  ASSERT_TRUE(scripts.trigger("late", kStart + seconds(2)));
  EXPECT_THAT(due(scripts, 2), ElementsAre("once"));
  EXPECT_THAT(due(scripts, 2.5), ElementsAre("late")) << "it waits for its delay";
  EXPECT_THAT(due(scripts, 60), IsEmpty());
  scripts.handle(happened(EventKind::agent_spawned, 61, "a"));
  EXPECT_THAT(due(scripts, 62), IsEmpty()) << "it has run";
}

TEST(Scripts, UnknownScriptsAreRefusedByName) {
  tick::Scripts scripts({at_time("door slams", 100)}, {}, kStart), none({}, {}, kStart);
  const Status unknown = scripts.trigger("dor slams", kStart);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, testing::HasSubstr("door slams"));
  EXPECT_THAT(due(scripts, 1), IsEmpty());
  ASSERT_FALSE(none.trigger("door slams", kStart));
}

TEST(Scripts, MutuallyTriggeringScriptsDoNotBlockAStep) {
  Script again = on_event("again", EventKind::command_refused);
  again.repeat = true;
  tick::Scripts scripts({again}, {}, kStart);
  for (int step = 1; step < 100; ++step) {
    const double t = step / 240.0;
    // Each run of the script causes two more events that trigger it.
    scripts.handle(happened(EventKind::command_refused, t, "a"));
    scripts.handle(happened(EventKind::command_refused, t, "a"));
    EXPECT_EQ(due(scripts, t).size(), 1U);
  }
}

TEST(Scripts, NearnessStartsOnceAndEndsWithHysteresis) {
  tick::Scripts scripts({near("near", "guide", 2, true)}, {}, kStart);
  double distance = 3;
  const auto place = [&](const std::string& who) -> std::optional<Eigen::Vector3d> {
    return who == kTrainee ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(distance, 0, 5);
  };
  EXPECT_THAT(due(scripts, 1, place), IsEmpty());
  distance = 2;
  EXPECT_THAT(due(scripts, 2, place), ElementsAre("near"));
  distance = 2.1;
  EXPECT_THAT(due(scripts, 3, place), IsEmpty());
  distance = 1.9;
  EXPECT_THAT(due(scripts, 4, place), IsEmpty()) << "it had never been farther";
  distance = 2.3;
  EXPECT_THAT(due(scripts, 5, place), IsEmpty());
  distance = 1.9;
  EXPECT_THAT(due(scripts, 6, place), ElementsAre("near"));
  EXPECT_THAT(due(scripts, 7), IsEmpty());
  EXPECT_THAT(due(scripts, 8, place), ElementsAre("near")) << "a removed agent is not near";
}

/// The room with a door across the robot's circle: the robot is in the opening about 3 s after the start.
tick::Configuration with_scripts(std::vector<Script> scripts) {
  Scenario scenario;
  scenario.name = "scripts";
  scenario.agents = {test::agent("guide", AgentKind::person, 4, 3)};
  scenario.scripts = std::move(scripts);
  SemanticModel model = test::room();
  ModelEntity door;
  door.name = "door 2";
  door.label = EntityLabel::door;
  const double angle = 2 * std::numbers::pi * 3 / 40;
  door.T_map_body = Transform<Map, Body>::planar(1.5 * std::cos(angle), 1.5 * std::sin(angle), angle, 1);
  door.size = {1, 0.04, 2};
  model.entities.push_back(door);
  return *tick::configure(scenario, test::robot(), model);
}

/// "When the trainee passes door 2, a person comes out."
Script visitor() {
  Script script = on_event("visitor", EventKind::door_space_left, kTrainee, "door 2");
  script.after = 0.25;
  AgentSpawn spawn;
  spawn.agent = test::agent("visitor", AgentKind::person, -3, -3, BehaviourKind::go);
  spawn.agent.behaviour.waypoints = {{3, -3}};
  spawn.agent.behaviour.speed = 1;
  script.actions = {spawn};
  return script;
}

class ScriptPath : public test::TickTest {
 protected:
  std::vector<Event> events(EventKind kind) {
    auto all = decoded<Event>(channel::kMrEvents);
    std::erase_if(all, [&](const Event& event) { return event.kind != kind; });
    return all;
  }
};

TEST_F(ScriptPath, APersonAppearsAfterTheTraineePassesTheDoor) {
  start(with_scripts({visitor()}));
  feed(test::drive(8));
  const auto left = events(EventKind::door_space_left), started = events(EventKind::script_started);
  ASSERT_EQ(left.size(), 1U);
  ASSERT_EQ(started.size(), 1U);
  EXPECT_EQ(started[0].subject, "visitor");
  EXPECT_EQ(started[0].object, left[0].subject);
  EXPECT_NEAR((started[0].stamp - left[0].stamp).seconds(), 0.25, 1 / 240.0);
  const auto spawned = events(EventKind::agent_spawned);
  ASSERT_EQ(spawned.size(), 2U) << "the guide, at the start, and the visitor";
  EXPECT_EQ(spawned[1].subject, "visitor");
  EXPECT_EQ(spawned[1].stamp, started[0].stamp);
  const auto place = state_->simulation.pose_of("visitor");
  ASSERT_TRUE(place.has_value());
  EXPECT_GT(place->translation().x(), -2.5) << "it walks";
}

TEST_F(ScriptPath, AnImpossibleActionIsRefusedWithItsScript) {
  Script script = near("meet", "guide", 20);
  script.actions = visitor().actions;
  std::get<AgentSpawn>(script.actions[0]).agent.name = "guide";
  Script after = on_event("after", EventKind::script_started, "meet");
  after.actions = {AgentRemove{.agent = "guide"}};
  start(with_scripts({script, after}));
  feed(test::drive(1));
  const auto refused = events(EventKind::command_refused);
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_THAT(refused[0].text, testing::HasSubstr("script 'meet': "));
  EXPECT_EQ(events(EventKind::script_started).size(), 2U);
  EXPECT_EQ(events(EventKind::agent_removed).size(), 1U);
}

TEST(ScriptNames, UnknownNamesAreRefusedAtTheStart) {
  Script script = visitor();
  script.when.object = "dor 2";
  const auto state = tick::make_state(with_scripts({script}), ArrivalTime{});
  ASSERT_FALSE(state.ok());
  EXPECT_THAT(state.error().message, testing::HasSubstr("script 'visitor': it waits for 'dor 2'"));
  EXPECT_THAT(state.error().message, testing::HasSubstr("did you mean 'door 2'"));
}

/// A crowd with lasers, a drawn door that is pushed, scripts that send an agent through it.
tick::Configuration busy(const test::TemporaryFolder& folder, int robots) {
  tick::Configuration configuration =
      with_scripts({visitor(), near("meet", "guide", 4), at_time("at 2 s", 2)});
  Scenario& scenario = configuration.scenario;
  scenario.seed = 7;
  scenario.model = folder / "model.yaml";
  for (const std::size_t i : {1U, 2U})
    scenario.scripts[i].actions.emplace_back(AgentFreeze{.agent = "guide", .frozen = i == 1});
  ModelEntity drawn = configuration.model.entities.back();
  drawn.name = "drawn door";
  drawn.is_virtual = true;
  drawn.T_map_body = Transform<Map, Body>::planar(-1.5, -3, std::numbers::pi / 2, 1);
  configuration.model.entities.push_back(drawn);
  for (int i = 0; i < robots; ++i) {
    AgentDefinition robot = test::agent("robot_" + std::to_string(i), AgentKind::robot, -4 + 1.2 * (i % 7),
                                        2 + 0.9 * (i / 7), BehaviourKind::wander);
    if (i % 2 == 0) robot.laser = "lms-200";
    scenario.agents.push_back(robot);
  }
  std::ofstream(folder / "model.yaml") << to_yaml(configuration.model);
  std::ofstream(folder / "scenario.yaml") << to_yaml(scenario);
  return configuration;
}

/// PARHELION_LONG=1: more robots, a longer drive, ten runs of each.
TEST(ScriptReplay, IsIdenticalForAnyThreadCountAndOnEachRun) {
  const test::TemporaryFolder folder;
  busy(folder, test::long_run() ? 12 : 4);
  test::write_log(folder / "drive.lcm", test::drive(test::long_run() ? 40 : 9));
  std::map<std::string, std::string> first;
  for (int round = 0; round < (test::long_run() ? 10 : 1); ++round) {
    for (const int threads : {1, 2, 8}) {
      ReplayOptions options;
      options.log = folder / "drive.lcm";
      options.scenario = folder / "scenario.yaml";
      options.session = folder / "a.lcm";
      options.overwrite = true;
      options.threads = threads;
      const auto report = replay(options);
      ASSERT_TRUE(report.ok()) << report.error().message;
      ASSERT_GE(report->tally.events[static_cast<std::size_t>(EventKind::script_started)], 2U);
      ASSERT_GE(report->tally.events[static_cast<std::size_t>(EventKind::door_opened)], 1U);
      ASSERT_TRUE(report->hash.contains(channel::kMrWorld) && report->hash.contains(channel::kMrEvents));
      if (first.empty()) first = report->hash;
      EXPECT_EQ(report->hash, first) << "round " << round << ", " << threads << " threads";
    }
  }
  ReplayOptions again;
  again.log = folder / "a.lcm";
  again.session = folder / "b.lcm";
  const auto replayed = replay(again);
  ASSERT_TRUE(replayed.ok()) << replayed.error().message;
  EXPECT_EQ(replayed->hash, first) << "the session's own log, without its scenario's file";
}

}  // namespace
}  // namespace parhelion::runtime
