// The briefing lists everything that is graded.
#include "server/training/briefing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace parhelion::training {
namespace {

using testing::HasSubstr;

constexpr const char* kTrainingScenario = R"(name: Stairs
level: 1
training:
  text: Up to the gallery.
  limit: 5 min
  pass_mark: 0.6
  grades: [{name: A, from: 0.9}, {name: B, from: 0.6}]
  tasks:
    - name: door
      text: Mind the frame.
      points: 20
      required: true
      limit: 60 s
      done: {pass: door 1, within: 50 s, never: {event: contact_started, object: door 1, impulse: 0.5 N s}}
    - name: crate
      points: 40
      done: {then: [{grip: crate}, {any: [{place: crate, into: box}, {near: dock, distance: 1 m, for: 3 s}]}]}
      failed: {event: dropped, count: 2}
  penalties:
    - {name: collision, points: 5, per_impulse: 0.5, max: 30, when: {event: contact_started}}
    - {name: lean, points: 1, when: {pitch: 20 deg}}
faults: [{dead_wheel: left}]
)";

TEST(Briefing, ListsTasksTimeScaleAndEveryPenalty) {
  const auto scenario = parse_scenario(kTrainingScenario, "s.yaml");
  ASSERT_TRUE(scenario.ok()) << scenario.error().message;
  EXPECT_EQ(briefing(*scenario, {"rover"}), R"(Stairs (level 1), with rover
Up to the gallery.
Time: 5 min in total.
Tasks, one after the other:
  1. door: 20 points, required, at most 60 s
     Mind the frame.
     done:   pass through door 1, within 50 s, without touching door 1 with 0.5 N s or more
  2. crate: 40 points
     done:   (grip crate, then (place crate in box or stay within 1 m of dock for 3 s))
     failed: dropping anything, 2 times
Points: 60 for all tasks, less penalties; passed with 60 % or more.
  grade A from 90 %
  grade B from 60 %
Penalties, each time:
  collision: 5 points and 0.5 points for each N s, at most 30 in all, for touching anything
  lean: 1 point, for pitch of 20 deg or more
)") << "and nothing of the dead wheel";
}

TEST(Briefing, EveryConditionHasAText) {
  for (int kind = 0; kind <= static_cast<int>(Condition::Kind::then); ++kind) {
    Condition condition;
    condition.kind = static_cast<Condition::Kind>(kind);
    condition.target = "it";
    condition.duration = 1;
    condition.parts.emplace_back();
    EXPECT_FALSE(condition_text(condition).empty()) << kind;
    EXPECT_FALSE(cause_text(condition).empty()) << kind;
  }
}

/// "points for come within 0.8 m of guide, without reach the yard" is no English.
TEST(Briefing, NamesACauseByWhatTheTraineeDoes) {
  Condition near;
  near.kind = Condition::Kind::near;
  near.target = "guide";
  near.distance = 0.8;
  Condition reach;
  reach.kind = Condition::Kind::reach;
  reach.target = "yard";
  Condition any;
  any.kind = Condition::Kind::any;
  any.parts = {near, reach};
  EXPECT_EQ(condition_text(any), "(come within 0.8 m of guide or reach yard)");
  EXPECT_EQ(cause_text(any), "(coming within 0.8 m of guide or reaching yard)");
  near.never = {reach};
  near.duration = 3;
  EXPECT_EQ(condition_text(near), "stay within 0.8 m of guide for 3 s, without reaching yard");
  for (int kind = 0; kind <= static_cast<int>(Condition::Kind::place); ++kind) {
    Condition condition;
    condition.kind = static_cast<Condition::Kind>(kind);
    condition.target = "it";
    EXPECT_THAT(cause_text(condition), testing::MatchesRegex("(not )?[a-z]+ing .*")) << kind;
  }
}

TEST(Briefing, DescribesWhatATraineeMustNotDo) {
  Condition condition;
  condition.event = EventKind::zone_left;
  condition.object = "mark 3";
  EXPECT_EQ(condition_text(condition), "leaving mark 3");
  condition = {};
  condition.event = EventKind::hazard_triggered;
  condition.subject = "any";
  EXPECT_EQ(condition_text(condition), "setting off anything, by anybody");
  condition = {};
  condition.event = EventKind::placed;
  condition.object = "container_1";
  EXPECT_EQ(condition_text(condition), "putting something into container_1");
  condition = {};
  condition.event = EventKind::speed_limited;
  EXPECT_EQ(condition_text(condition), "speed limited");
}

TEST(Briefing, NamesNoEventByItsIdentifier) {
  for (int kind = 0; kind <= static_cast<int>(EventKind::scans_conflict); ++kind) {
    Condition condition;
    condition.event = static_cast<EventKind>(kind);
    EXPECT_EQ(condition_text(condition).find('_'), std::string::npos) << condition_text(condition);
  }
}

TEST(Briefing, DescribesANearMissByDistanceAndTime) {
  Condition condition;
  condition.event = EventKind::near_miss;
  condition.object = "guide";
  EXPECT_EQ(condition_text(condition), "passing too near to guide or almost driving into guide");
  condition.text = "gap";
  condition.max = 0.15;
  EXPECT_EQ(condition_text(condition), "passing guide nearer than 0.15 m");
  condition.text = "time";
  condition.max = 0.8;
  EXPECT_EQ(condition_text(condition), "almost driving into guide, less than 0.8 s from it");
  condition.object.clear();
  EXPECT_EQ(condition_text(condition), "almost driving into anything, less than 0.8 s from it");
}

TEST(Briefing, WithoutATrainingThereIsNoBriefing) { EXPECT_EQ(briefing(Scenario{}, {"rover"}), ""); }

TEST(Briefing, NamesEachRobotThatIsGraded) {
  const auto scenario = parse_scenario(kTrainingScenario, "s.yaml");
  ASSERT_TRUE(scenario.ok());
  EXPECT_THAT(briefing(*scenario, {"r1", "r2"}), HasSubstr("with r1 and r2, each graded separately\n"));
  EXPECT_THAT(briefing(*scenario, {"r1", "r2", "r3"}), HasSubstr("with r1, r2 and r3, each graded"));
}

}  // namespace
}  // namespace parhelion::training
