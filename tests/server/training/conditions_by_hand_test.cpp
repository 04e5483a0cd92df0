// Small scenarios as a user writes them, each with its score computed by hand: each kind of condition, alone
// and combined.
#include "tests/server/training/synthetic_session.hpp"

namespace parhelion::training {
namespace {

using enum EventKind;
using test::SyntheticSession;

TEST(ConditionsByHand, ACountIsReachedAtItsLastEvent) {
  SyntheticSession session("  tasks: [{name: t, points: 8, done: {event: gripped, count: 3}}]\n");
  session.add_event(1, gripped, {.object = "a"}).add_event(2, gripped, {.object = "b"});
  EXPECT_EQ(session.score(), 0);
  session.add_event(3, gripped, {.object = "a"});
  EXPECT_EQ(session.score(), 8);
  EXPECT_EQ(session.grade().tasks[0].ended, SyntheticSession::at(3));
}

TEST(ConditionsByHand, AnImpulseCountsFromItsMinimum) {
  SyntheticSession session(
      "  tasks: [{name: t, points: 4, done: {event: contact_started, impulse: 2 N s}}]\n");
  session.add_event(1, contact_started, {.object = "wall 1", .impulse = 1.75});
  EXPECT_EQ(session.score(), 0);
  session.add_event(2, contact_started, {.object = "wall 1", .impulse = 2});
  EXPECT_EQ(session.score(), 4);
}

TEST(ConditionsByHand, AValueCountsFromMinimumToMaximum) {
  SyntheticSession session(
      "  tasks: [{name: t, points: 4, done: {event: fell, min: 0.5, max: 1, count: 3}}]\n");
  session.add_event(1, fell, {.value = 0.25})
      .add_event(2, fell, {.value = 0.5})
      .add_event(3, fell, {.value = 1.25});
  session.add_event(4, fell, {.value = 0.75});
  EXPECT_EQ(session.score(), 0) << "two of four";
  session.add_event(5, fell, {.value = 1});
  EXPECT_EQ(session.score(), 4);
}

TEST(ConditionsByHand, OnlyTheNamedObjectCounts) {
  SyntheticSession session("  tasks: [{name: t, points: 4, done: {event: lifted, object: crate}}]\n");
  EXPECT_EQ(session.add_event(1, lifted, {.object = "barrel"}).score(), 0);
  EXPECT_EQ(session.add_event(2, lifted, {.object = "crate"}).score(), 4);
}

TEST(ConditionsByHand, TheSubjectDefaultsToTheRobot) {
  SyntheticSession session(
      "  order: free\n"
      "  tasks:\n"
      "    - {name: own, points: 1, done: {event: fell}}\n"
      "    - {name: another, points: 2, done: {event: fell, subject: person_1}}\n"
      "    - {name: anybody, points: 4, done: {event: fell, subject: any}}\n");
  EXPECT_EQ(session.add_event(1, fell, {.subject = "robot_2"}).score(), 4);
  EXPECT_EQ(session.add_event(2, fell, {.subject = "person_1"}).score(), 4 + 2);
  EXPECT_EQ(session.add_event(3, fell).score(), 4 + 2 + 1);
}

TEST(ConditionsByHand, EventsBeforeATaskStartsDoNotCount) {
  SyntheticSession session(
      "  tasks:\n"
      "    - {name: first, points: 2, done: {reach: hall}}\n"
      "    - {name: second, points: 4, done: {event: gripped}}\n");
  session.add_event(1, gripped).add_event(2, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 2);
  EXPECT_EQ(session.add_event(3, gripped).score(), 2 + 4);
}

TEST(ConditionsByHand, OnlyTheRobotReachesAZoneAndItStaysReached) {
  SyntheticSession session(
      "  tasks: [{name: t, points: 4, done: {reach: hall}}, {name: u, points: 1, done: {event: fell}}]\n");
  session.add_event(1, zone_entered, {.object = "hall", .subject = "robot_2"});
  session.add_event(2, zone_entered, {.object = "yard"}).world(2.5);
  EXPECT_EQ(session.score(), 0);
  session.add_event(3, zone_entered, {.object = "hall"}).add_event(4, zone_left, {.object = "hall"});
  EXPECT_EQ(session.score(), 4);
}

TEST(ConditionsByHand, ADoorIsPassedInBothDirections) {
  SyntheticSession session(
      "  tasks: [{name: t, points: 6, done: {then: [{pass: door 1}, {pass: door 1}]}}]\n");
  const auto crosses = [&](double t, double from, double to, const std::string& who) {
    session.add_event(t, door_space_entered, {.object = "door 1", .x = from, .subject = who});
    session.add_event(t + 1, door_space_left, {.object = "door 1", .x = to, .subject = who});
  };
  crosses(1, 0.5, -0.5, "rover");
  crosses(3, -0.5, 0.5, "robot_2");
  crosses(5, -0.5, -0.5, "rover");  // entered, and went back
  EXPECT_EQ(session.score(), 0);
  crosses(7, -0.5, 0.5, "rover");
  EXPECT_EQ(session.score(), 6);
}

TEST(ConditionsByHand, AFlightIsClimbedAtItsOwnHighestStep) {
  SyntheticSession session("  tasks: [{name: t, points: 5, done: {climb: stairs 1}}]\n");
  session.add_event(1, step_climbed, {.object = "stairs 1 step 2"});
  session.add_event(2, step_climbed, {.object = "stairs 2 step 3"});
  session.add_event(3, step_climbed, {.object = "stairs 1 step 3", .subject = "robot_2"});
  EXPECT_EQ(session.score(), 0);
  EXPECT_EQ(session.add_event(4, step_climbed, {.object = "stairs 1 step 3"}).score(), 5);
}

TEST(ConditionsByHand, AClimbFailsOnExcessivePitchOrRoll) {
  for (const EventKind kind : {pitch_warning, pitch_limit, roll_limit}) {
    SyntheticSession session(
        "  tasks:\n"
        "    - name: t\n"
        "      points: 5\n"
        "      done: {climb: stairs 1, never: {any: [{event: pitch_limit}, {event: roll_limit}]}}\n");
    session.add_event(1, step_climbed, {.object = "stairs 1 step 1"}).add_event(2, kind);
    session.add_event(3, step_climbed, {.object = "stairs 1 step 3"});
    EXPECT_EQ(session.score(), kind == pitch_warning ? 5 : 0) << to_string(kind);
  }
}

TEST(ConditionsByHand, NearnessIsThePlanarDistanceOfOrigins) {
  SyntheticSession session("  tasks: [{name: t, points: 4, done: {near: door 1, distance: 2.5 m}}]\n");
  EXPECT_EQ(session.world(1, {{"rover", -2, -2}}).score(), 0) << "2.83 m";
  EXPECT_EQ(session.world(2, {{"rover", -1.5, -2}}).score(), 4) << "2.5 m: 1.5, 2, 2.5";
}

TEST(ConditionsByHand, FollowingEndsWhenItsTargetIsRemoved) {
  SyntheticSession session(
      "  tasks: [{name: t, points: 4, done: {near: person_1, distance: 2 m, for: 2 s}}]\n");
  session.world(0, {{"rover"}, {"person_1", 1}}).world(1, {{"rover"}, {"person_1", 1}}).world(1.5);
  session.world(2, {{"rover"}, {"person_1", 1}}).world(3.75, {{"rover"}, {"person_1", 1}});
  EXPECT_EQ(session.score(), 0) << "1.75 s on end";
  EXPECT_EQ(session.world(4, {{"rover"}, {"person_1", 1}}).score(), 4);
}

TEST(ConditionsByHand, StandstillCountsFromTheStartOfItsTask) {
  SyntheticSession session("  tasks: [{name: t, points: 4, done: {then: [{reach: dock}, {still: 3 s}]}}]\n");
  session.world(1).world(9);  // no motion yet
  session.add_event(10, movement_started)
      .add_event(12, movement_stopped)
      .add_event(14, zone_entered, {.object = "dock"});
  session.world(15).world(17.75);
  EXPECT_EQ(session.score(), 0) << "looked at from 15 s on";
  EXPECT_EQ(session.world(18).score(), 4);
}

TEST(ConditionsByHand, InspectingRestartsAfterLookingAway) {
  SyntheticSession session(
      "  tasks: [{name: t, points: 4, done: {inspect: gauge, distance: 3 m, for: 2 s}}]\n");
  const auto looks = [&](double t, double yaw) {
    session.world(t, {{"rover", -5, 0, yaw}, {"gauge", -3, 0}});
  };
  looks(0, 0);
  looks(1.5, 0.5);  // 28.6 degrees off: in the image
  looks(1.75, 1);   // 57.3 degrees off: not in the image
  looks(2, 0);
  looks(3.75, 0);
  EXPECT_EQ(session.score(), 0);
  looks(4, 0);
  EXPECT_EQ(session.score(), 4);
}

TEST(ConditionsByHand, InspectingWorksThroughWindowsButNotWalls) {
  for (const double y : {3.0, -2.0}) {
    SyntheticSession session("  tasks: [{name: t, points: 4, done: {inspect: gauge, distance: 3 m}}]\n");
    session.world(1, {{"rover", -1, y}, {"gauge", 1, y}});
    EXPECT_EQ(session.score(), y < 0 ? 4 : 0);
  }
}

TEST(ConditionsByHand, AllHoldsInAnyOrderAndItsLastEventIsTheCause) {
  SyntheticSession session(
      "  tasks: [{name: t, points: 9, done: {all: [{reach: a}, {event: gripped}, {climb: stairs 1}]}}]\n");
  session.add_event(1, step_climbed, {.object = "stairs 1 step 3"})
      .add_event(2, gripped, {.object = "crate"});
  EXPECT_EQ(session.score(), 0);
  session.add_event(3, zone_entered, {.object = "a"});
  EXPECT_EQ(session.score(), 9);
  EXPECT_EQ(session.grade().tasks[0].cause->object, "a");
}

TEST(ConditionsByHand, OneEventMayCountTwiceInAllButOnceInThen) {
  SyntheticSession session(
      "  order: free\n"
      "  tasks:\n"
      "    - {name: all, points: 1, done: {all: [{event: gripped}, {event: gripped, object: crate}]}}\n"
      "    - {name: then, points: 2, done: {then: [{event: gripped}, {event: gripped}]}}\n");
  EXPECT_EQ(session.add_event(1, gripped, {.object = "crate"}).score(), 1);
  EXPECT_EQ(session.add_event(2, gripped, {.object = "crate"}).score(), 1 + 2);
}

TEST(ConditionsByHand, AnyFailsOnlyWithItsLastAlternative) {
  SyntheticSession session(
      "  tasks: [{name: t, points: 4, done: {any: [{reach: a, within: 5 s}, {reach: b, within: 10 s}]}}]\n");
  EXPECT_EQ(session.world(6).outcome(), TaskOutcome::open);
  EXPECT_EQ(session.world(11).outcome(), TaskOutcome::failed);
  EXPECT_EQ(session.add_event(12, zone_entered, {.object = "b"}).score(), 0);
}

TEST(ConditionsByHand, NeverInOneAlternativeFailsOnlyThatAlternative) {
  SyntheticSession session(
      "  tasks:\n"
      "    - name: t\n"
      "      points: 4\n"
      "      done: {any: [{reach: a, never: {event: contact_started}}, {reach: b}]}\n");
  session.add_event(1, contact_started, {.object = "wall 1"}).add_event(2, zone_entered, {.object = "a"});
  EXPECT_EQ(session.outcome(), TaskOutcome::open);
  EXPECT_EQ(session.add_event(3, zone_entered, {.object = "b"}).score(), 4);
}

TEST(ConditionsByHand, ASequenceWithinASetWaitsForItsOwnOrder) {
  SyntheticSession session(
      "  tasks:\n"
      "    - name: t\n"
      "      points: 4\n"
      "      done: {all: [{then: [{event: gripped}, {event: placed, object: tub}]}, {reach: a}]}\n");
  session.add_event(1, placed, {.object = "tub"})
      .add_event(2, zone_entered, {.object = "a"})
      .add_event(3, gripped);
  EXPECT_EQ(session.score(), 0) << "placed before it was gripped";
  EXPECT_EQ(session.add_event(4, placed, {.object = "tub"}).score(), 4);
}

TEST(ConditionsByHand, WithinIncludesItsTimeLimit) {
  for (const double t : {4.0, 4.25}) {
    SyntheticSession session("  tasks: [{name: t, points: 4, done: {event: gripped, within: 4 s}}]\n");
    EXPECT_EQ(session.add_event(t, gripped).score(), t > 4 ? 0 : 4);
  }
}

TEST(ConditionsByHand, WithinOfALaterPartStartsWithThatPart) {
  SyntheticSession session(
      "  tasks: [{name: t, points: 4, done: {then: [{event: lifted}, {event: placed, within: 5 s}]}}]\n");
  session.world(30).add_event(31, lifted).add_event(36, placed);
  EXPECT_EQ(session.score(), 4);
}

}  // namespace
}  // namespace parhelion::training
