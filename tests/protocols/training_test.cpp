// Tasks and grading in a scenario: valid ones, and error messages for mistakes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocols/scenario.hpp"
#include "tests/protocols/scenario_error.hpp"

namespace parhelion {
namespace {

using testing::HasSubstr;
using Kind = Condition::Kind;

const std::string kWhole = R"(training:
  text: Through the door and up the stairs.
  limit: 5 min
  order: listed
  pass_mark: 0.6
  grades: [{name: A, from: 0.9}, {name: B, from: 0.6}]
  tasks:
    - name: door
      points: 20
      required: true
      skills: [doors, "wheels: no touch"]
      limit: 60 s
      done:
        pass: door 1
        never: {event: contact_started, object: door 1, impulse: 0.5 N s}
    - name: crate
      points: 40
      done:
        then:
          - {event: gripped, object: crate}
          - any: [{event: placed, object: box}, {reach: dock, within: 30 s}]
          - {near: crate, distance: 50 cm, for: 2 s}
      failed: {event: dropped, count: 2}
    - name: round
      points: 5
      done:
        all:
          - {report: gauge, distance: 1 m}
          - {follow: guide, distance: 2 m, for: 10 s}
          - {avoid: robot_2, for: 30 s}
          - {avoid: robot_2, distance: 1 m, for: 20 s}
          - {grip: crate}
          - {lift: crate}
          - {place: crate, into: box}
  penalties:
    - {name: collision, per_impulse: 0.5, points: 5, max: 30, when: {event: contact_started}}
    - {name: pitch, points: 1, when: {pitch: 20 deg, for: 500 ms}}
    - {name: roll, points: 1, when: {roll: 0.25 rad}}
    - {name: spin, points: 1, when: {yaw_rate: 1 rad/s}}
    - {name: fast, points: 1, when: {speed: 0.8 m/s, for: 1 s}}
    - {name: held back, points: 1, when: {event: speed_limited, text: contact}}
    - {name: near miss, points: 2, when: {event: collision_predicted, max: 1.5}}
)";

using test::error_of;

TEST(Training, ReadsNestedConditionsOfAnyDepth) {
  const auto scenario = parse_scenario(kWhole, "s.yaml");
  ASSERT_TRUE(scenario.ok()) << scenario.error().message;
  ASSERT_TRUE(scenario->training.has_value());
  const Training& training = *scenario->training;
  EXPECT_EQ(training.limit, 300);
  EXPECT_TRUE(training.in_order);
  ASSERT_EQ(training.tasks.size(), 3U);
  const Task& door = training.tasks[0];
  EXPECT_EQ(door.done.kind, Kind::pass);
  EXPECT_EQ(door.done.target, "door 1");
  EXPECT_EQ(door.skills, (std::vector<std::string>{"doors", "wheels: no touch"}));
  EXPECT_TRUE(training.tasks[1].skills.empty());
  ASSERT_EQ(door.done.never.size(), 1U);
  EXPECT_EQ(door.done.never[0].event, EventKind::contact_started);
  EXPECT_EQ(door.done.never[0].impulse, 0.5);
  const Condition& crate = training.tasks[1].done;
  EXPECT_EQ(crate.kind, Kind::then);
  ASSERT_EQ(crate.parts.size(), 3U);
  EXPECT_EQ(crate.parts[1].kind, Kind::any);
  EXPECT_EQ(crate.parts[1].parts[1].within, 30);
  EXPECT_EQ(crate.parts[2].distance, 0.5);
  EXPECT_EQ(crate.parts[2].duration, 2);
  EXPECT_EQ(training.tasks[1].failed[0].count, 2U);
  const Condition& round = training.tasks[2].done;
  EXPECT_EQ(round.parts[0].distance, 1);
  EXPECT_EQ(round.parts[1].duration, 10);
  EXPECT_EQ(round.parts[2].distance, 0);
  EXPECT_EQ(round.parts[6].target, "crate");
  EXPECT_EQ(round.parts[6].into, "box");
  EXPECT_EQ(training.penalties[1].when.duration, 0.5);
  EXPECT_EQ(training.penalties[2].when.amount, 0.25);
  EXPECT_EQ(training.penalties[5].when.text, "contact");
  EXPECT_EQ(training.penalties[6].when.max, 1.5);
}

TEST(Training, RoundTripsThroughYaml) {
  const auto scenario = parse_scenario(kWhole, "s.yaml");
  ASSERT_TRUE(scenario.ok());
  const std::string written = to_yaml(*scenario);
  const auto again = parse_scenario(written, "again.yaml");
  ASSERT_TRUE(again.ok()) << again.error().message << "\n" << written;
  EXPECT_EQ(to_yaml(*again), written);
  EXPECT_EQ(again->training->tasks[1].done.parts[1].parts[1].within, 30);
  EXPECT_EQ(again->training->tasks[0].done.never[0].impulse, 0.5);
  EXPECT_EQ(again->training->tasks[2].done.parts[6].into, "box");
  EXPECT_EQ(again->training->penalties[1].when.amount, scenario->training.value().penalties[1].when.amount);
  EXPECT_EQ(again->training->tasks[0].skills, scenario->training->tasks[0].skills);
}

TEST(Training, AMistakeIsReportedWithItsLineAndTheNearestName) {
  const auto with = [](const std::string& done) {
    return "training:\n  tasks:\n    - name: t\n      points: 1\n      done: " + done + "\n";
  };
  const struct {
    std::string yaml, words;
  } mistakes[] = {
      {with("{raech: hall}"), "s.yaml:5: unknown key 'raech', did you mean 'reach'?"},
      {with("{event: contct_started}"),
       "s.yaml:5: unknown event 'contct_started', did you mean 'contact_started'?"},
      {with("{reach: hall, pass: door 1}"), "s.yaml:5: a condition: found two"},
      {with("{within: 3 s}"), "s.yaml:5: a condition: expected one of event, reach"},
      {with("{reach: hall, distance: 3 m}"), "'distance' does not go with 'reach'"},
      {with("{near: crate}"), "a distance is missing"},
      {with("{near: crate, distance: 3}"), "s.yaml:5: 'distance'"},
      {with("{follow: guide, distance: 2 m}"), "a time is missing"},
      {with("{avoid: guide, distance: 2 m}"), "a time is missing"},
      {with("{grip: crate, into: box}"), "'into' does not go with 'grip'"},
      {with("{pitch: 20}"), "s.yaml:5: 'pitch'"},
      {with("{event: score_changed}"), "is reported by the grading itself"},
      {with("hall"), "s.yaml:5: expected keys with values, found a single value"},
      {with("{all: []}"), "s.yaml:5: 'all': expected at least 1 item"},
      {with("\n        all:\n          - {reach: a}\n          - {then: [{rech: b}]}"),
       "s.yaml:8: unknown key 'rech'"},
      {with("{reach: a}\n      skills: [doors, stairs, doors]"),
       "s.yaml:6: 'skills': 'doors' is a duplicate"},
      {with("{reach: a, within: 20 s}\n      limit: 10 s"), "its condition may take longer than its limit"},
      {"training:\n  limit: 30 s\n  tasks:\n    - {name: t, points: 1, limit: 31 s, done: {reach: a}}\n",
       "s.yaml:4: task 't': its limit of 31 s is after that of the whole, 30 s"},
      {with("{follow: a, distance: 1 m, for: 20 s}\n      limit: 10 s"),
       "it takes at least 20 s, its limit is 10 s"},
      {with("{then: [{still: 3 s}, {any: [{still: 4 s}, {still: 9 s}]}], within: 6 s}"),
       "its condition takes at least 7 s, and has to be within 6 s"},
      {"training:\n  limit: 30 s\n  tasks:\n    - {name: a, points: 1, done: {still: 20 s}}\n"
       "    - {name: b, points: 1, done: {still: 11 s}}\n",
       "s.yaml:5: task 'b': it cannot be done in time: the tasks up to it take at least 31 s"},
      {with("{reach: a}") + "    - {name: t, points: 2, done: {reach: b}}\n",
       "s.yaml:6: name 't' is taken by the task in line 3"},
      {with("{reach: a}") + "  penalties: [{name: p, when: {event: fell}}]\n",
       "s.yaml:6: penalty 'p' costs nothing"},
      {with("{reach: a}") + "  grades: [{name: B, from: 0.5}, {name: A, from: 0.9}]\n", "the best first"},
      {"training: {tasks: []}\n", "s.yaml:1: 'tasks': expected at least 1 item"},
  };
  for (const auto& mistake : mistakes)
    EXPECT_THAT(error_of(mistake.yaml), HasSubstr(mistake.words)) << mistake.yaml;
}

}  // namespace
}  // namespace parhelion
