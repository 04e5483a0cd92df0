// Scripts in a scenario: valid ones, and error messages for mistakes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocols/scenario.hpp"

namespace parhelion {
namespace {

using testing::HasSubstr;

const std::string kAgents = R"(agents:
  - {name: guide, kind: person, pose: {x: 1 m}}
)";

std::string script_error(const std::string& scripts) {
  const auto scenario = parse_scenario(kAgents + "scripts:\n" + scripts, "s.yaml");
  return scenario ? "" : scenario.error().message;
}

TEST(Script, ReadsTheTriggerAndTheActions) {
  const auto scenario = parse_scenario(kAgents + R"(scripts:
  - name: visitor
    when: {event: door_space_left, subject: trainee, object: door 2}
    after: 500 ms
    do:
      - spawn: {name: visitor, kind: person, pose: {x: 2 m}, behaviour: {kind: go, waypoints: [[1 m, 1 m]]}}
      - behave: {name: guide, behaviour: {kind: flee, target: visitor, distance: 3 m}}
  - {name: alarm, when: {time: 10 s}, repeat: true, do: [{freeze: all}]}
  - {name: kitchen, when: {zone: kitchen}, do: [{move: {name: visitor, pose: {y: 1 m}}}, {remove: guide}]}
  - {name: greet, when: {near: guide, distance: 2 m}, do: [{remove_all: true}]}
)",
                                       "s.yaml");
  ASSERT_TRUE(scenario.ok()) << scenario.error().message;
  const auto& scripts = scenario->scripts;
  ASSERT_EQ(scripts.size(), 4U);
  EXPECT_EQ(scripts[0].when.kind, ScriptTrigger::Kind::event);
  EXPECT_EQ(scripts[0].when.event, EventKind::door_space_left);
  EXPECT_EQ(scripts[0].when.object, "door 2");
  EXPECT_EQ(scripts[0].after, 0.5);
  ASSERT_EQ(scripts[0].actions.size(), 2U);
  EXPECT_EQ(std::get<AgentSpawn>(scripts[0].actions[0]).agent.behaviour.kind, BehaviourKind::go);
  EXPECT_EQ(std::get<AgentBehaviour>(scripts[0].actions[1]).behaviour.target, "visitor");
  EXPECT_EQ(scripts[1].when.time, 10);
  EXPECT_TRUE(scripts[1].repeat);
  const auto& freeze = std::get<AgentFreeze>(scripts[1].actions[0]);
  EXPECT_TRUE(freeze.all && freeze.frozen);
  EXPECT_EQ(freeze.agent, "");
  EXPECT_EQ(scripts[2].when.event, EventKind::zone_entered);
  EXPECT_EQ(scripts[2].when.object, "kitchen");
  EXPECT_EQ(std::get<AgentMove>(scripts[2].actions[0]).agent, "visitor");
  EXPECT_EQ(std::get<AgentMove>(scripts[2].actions[0]).T_map_base.translation().y(), 1);
  EXPECT_EQ(std::get<AgentRemove>(scripts[2].actions[1]).agent, "guide");
  EXPECT_TRUE(std::get<AgentRemove>(scripts[3].actions[0]).all);
  EXPECT_EQ(scripts[3].when.subject, kTrainee);
  EXPECT_EQ(scripts[3].when.distance, 2);
}

TEST(Script, AMistakeIsReportedWithItsLineAndTheNearestName) {
  const std::string act = "    do: [{remove: guide}]\n";
  const struct {
    std::string yaml, words;
  } mistakes[] = {
      {"  - name: a\n    when: {event: door_space_enterd}\n" + act,
       "s.yaml:5: unknown event 'door_space_enterd', did you mean 'door_space_entered'?"},
      {"  - name: a\n    when: {time: 1 s}\n    do: [{remove: giude}]\n",
       "s.yaml:6: no agent 'giude' in 'agents' or spawned by a script, did you mean 'guide'?"},
      {"  - name: a\n    wen: {time: 1 s}\n" + act, "unknown key 'wen', did you mean 'when'?"},
      {"  - name: a\n    when: {time: 1 s, zone: x}\n" + act, "s.yaml:5: 'when': found two"},
      {"  - name: a\n    when: {subject: trainee}\n" + act, "expected one of time, event, zone, near"},
      {"  - name: a\n    when: {near: guide}\n" + act, "a distance is missing"},
      {"  - name: a\n    when: {near: trainee, distance: 1 m}\n" + act, "always near itself"},
      {"  - name: a\n    when: {time: 1 s, object: guide}\n" + act, "object does not go with this trigger"},
      {"  - name: a\n    when: {zone: x, distance: 1 m}\n" + act, "distance does not go"},
      {"  - name: a\n    when: {time: 0 s}\n    repeat: true\n" + act, "expected a time above 0 s"},
      {"  - name: a\n    when: {time: 1 s}\n    do: [{remove: guide, freeze: all}]\n", "'do': found two"},
      {"  - name: a\n    when: {time: 1 s}\n    do: []\n", "at least 1 item"},
      {"  - name: a\n    when: {time: 1 s}\n    do: [{spawn: {name: x/y, kind: box, pose: {x: 1 m}}}]\n",
       "part of channel names"},
      {"  - name: a\n    when: {time: 1 s}\n" + act + "  - name: a\n    when: {time: 1 s}\n" + act,
       "s.yaml:7: name 'a' is taken by the script in line 4"},
      {"  - name: a\n    when: {time: 1 s}\n    do: [{behave: {name: guide, behaviour: {kind: go}}}]\n",
       "go needs waypoints"},
  };
  for (const auto& mistake : mistakes)
    EXPECT_THAT(script_error(mistake.yaml), HasSubstr(mistake.words)) << mistake.yaml;
}

}  // namespace
}  // namespace parhelion
