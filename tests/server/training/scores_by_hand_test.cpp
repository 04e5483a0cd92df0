// Small scenarios as a user writes them, each with its score computed by hand: penalties, limits, order, pass
// marks, and truncated logs.
#include "tests/server/training/synthetic_session.hpp"

namespace parhelion::training {
namespace {

using enum EventKind;
using test::SyntheticSession;

const std::string kHall = "  tasks: [{name: hall, points: 100, done: {reach: hall}}]\n";

TEST(ScoresByHand, PenaltyPointsArePerEventPlusPerImpulse) {
  SyntheticSession session(
      kHall + "  penalties: [{name: hit, points: 3, per_impulse: 0.5, when: {event: contact_started}}]\n");
  session.add_event(1, contact_started, {.object = "wall 1", .impulse = 4});
  session.add_event(2, contact_started, {.object = "crate", .impulse = 0.5});
  session.add_event(3, zone_entered, {.object = "hall"});
  // 3 + 0.5 * 4 = 5, and 3 + 0.5 * 0.5 = 3.25
  EXPECT_EQ(session.grade().deductions[0].points, 5);
  EXPECT_EQ(session.grade().deductions[1].points, 3.25);
  EXPECT_EQ(session.score(), 100 - 8.25);
}

TEST(ScoresByHand, TheMaximumOfAPenaltyLimitsItsLastDeduction) {
  SyntheticSession session(
      kHall +
      "  penalties: [{name: hit, points: 3, per_impulse: 1, max: 10, when: {event: contact_started}}]\n");
  for (const double impulse : {2.0, 4.0, 1.0})
    session.add_event(impulse, contact_started, {.object = "wall 1", .impulse = impulse});
  session.add_event(9, zone_entered, {.object = "hall"});
  // 3 + 2 = 5; 3 + 4 = 7 of which 10 - 5 = 5 are left; then nothing
  ASSERT_EQ(session.grade().deductions.size(), 2U);
  EXPECT_EQ(session.grade().deductions[1].points, 5);
  EXPECT_EQ(session.score(), 90);
}

TEST(ScoresByHand, AContactWithoutImpulseHasNoImpulsePenalty) {
  SyntheticSession session(kHall +
                           "  penalties: [{name: hit, per_impulse: 2, when: {event: contact_started}}]\n");
  session.add_event(1, contact_started, {.object = "wall 1"});
  session.add_event(2, contact_started, {.object = "wall 1", .impulse = 1.5});
  session.add_event(3, zone_entered, {.object = "hall"});
  ASSERT_EQ(session.grade().deductions.size(), 1U);
  EXPECT_EQ(session.score(), 100 - 3);
}

TEST(ScoresByHand, TwoPenaltiesMayApplyToOneEvent) {
  SyntheticSession session(
      kHall +
      "  penalties:\n"
      "    - {name: any touch, points: 5, when: {event: contact_started}}\n"
      "    - {name: person, points: 30, when: {event: contact_started, object: person_1}}\n");
  session.add_event(1, contact_started, {.object = "person_1"})
      .add_event(2, contact_started, {.object = "crate"});
  session.add_event(3, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - (5 + 30) - 5);
}

TEST(ScoresByHand, AContinuingContactIsASeparateEvent) {
  SyntheticSession session(
      kHall +
      "  penalties:\n"
      "    - {name: touch, points: 5, when: {event: contact_started}}\n"
      "    - {name: push, points: 1, when: {event: contact_continues, impulse: 3 N s}}\n");
  session.add_event(1, contact_started, {.object = "crate"});
  for (const double impulse : {1.0, 3.0, 5.0})
    session.add_event(1 + impulse / 8, contact_continues, {.object = "crate", .impulse = impulse});
  session.add_event(2, contact_ended, {.object = "crate"}).add_event(3, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 5 - 2 * 1);
}

TEST(ScoresByHand, UnsensedEventsAreIgnored) {
  SyntheticSession session(
      "  order: free\n"
      "  tasks:\n"
      "    - {name: clean, points: 50, done: {reach: hall, never: {event: contact_started}}}\n"
      "    - {name: touches, points: 50, done: {event: contact_started, count: 2}}\n"
      "  penalties: [{name: hit, points: 5, when: {event: contact_started}}]\n");
  session.add_event(1, contact_started, {.object = "robot_1", .undetectable = true});
  session.add_event(2, zone_entered, {.object = "hall"});
  session.add_event(3, contact_started, {.object = "robot_1"});
  EXPECT_EQ(session.score(), 50 - 5);
  session.add_event(4, contact_started, {.object = "robot_1", .undetectable = true});
  EXPECT_EQ(session.score(), 50 - 5) << "one of two";
}

TEST(ScoresByHand, ACountRestartsWhenItIsReached) {
  SyntheticSession session(
      kHall + "  penalties: [{name: bumps, points: 4, when: {event: contact_started, count: 3}}]\n");
  for (int i = 1; i <= 7; ++i) session.add_event(i, contact_started, {.object = "wall 1"});
  session.add_event(9, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 2 * 4) << "3 + 3 + 1 bumps";
}

TEST(ScoresByHand, ASequenceIsPenalizedEachTimeItCompletes) {
  SyntheticSession session(
      kHall + "  penalties: [{name: lost, points: 6, when: {then: [{event: lifted}, {event: dropped}]}}]\n");
  session.add_event(1, dropped)
      .add_event(2, lifted)
      .add_event(3, dropped)
      .add_event(4, dropped)
      .add_event(5, lifted)
      .add_event(6, dropped);
  session.add_event(9, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 2 * 6) << "lifted and dropped at 3 and at 6";
}

TEST(ScoresByHand, ASequenceRestartsAfterItsTimeLimit) {
  SyntheticSession session(
      kHall +
      "  penalties: [{name: lost, points: 6, when: {then: [{event: lifted}, {event: dropped, "
      "within: 2 s}]}}]\n");
  session.add_event(1, lifted).add_event(5, dropped).add_event(6, lifted).add_event(7, dropped);
  session.add_event(9, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 6) << "4 s, then 1 s";
}

TEST(ScoresByHand, EachIdlePauseIsPenalizedOnce) {
  SyntheticSession session(kHall + "  penalties: [{name: idle, points: 2, when: {still: 5 s}}]\n");
  session.add_event(0, movement_started).add_event(1, movement_stopped).world(6).world(20).world(40);
  session.add_event(41, movement_started).add_event(42, movement_stopped).world(46.75);
  session.add_event(47, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 2 * 2) << "from 1 s to 41 s, and from 42 s to 47 s";
}

TEST(ScoresByHand, OnlyEnteringAZoneIsPenalized) {
  SyntheticSession session(kHall + "  penalties: [{name: danger, points: 7, when: {reach: danger}}]\n");
  session.add_event(1, zone_entered, {.object = "danger"})
      .world(2)
      .world(3)
      .add_event(4, zone_left, {.object = "danger"});
  session.add_event(5, zone_entered, {.object = "danger"}).world(6);
  session.add_event(7, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 2 * 7);
}

TEST(ScoresByHand, NothingIsDeductedAfterAllTasksAreDone) {
  SyntheticSession session(kHall + "  penalties: [{name: hit, points: 5, when: {event: contact_started}}]\n");
  session.add_event(1, contact_started, {.object = "wall 1"}).add_event(2, zone_entered, {.object = "hall"});
  session.add_event(3, contact_started, {.object = "wall 1"});
  EXPECT_EQ(session.score(), 95);
  EXPECT_EQ(session.grade().end, SyntheticSession::at(2));
}

TEST(ScoresByHand, AScoreIsNeverNegative) {
  SyntheticSession session(kHall +
                           "  grades: [{name: A, from: 0.5}]\n"
                           "  penalties: [{name: hit, points: 70, when: {event: contact_started}}]\n");
  session.add_event(1, contact_started)
      .add_event(2, contact_started)
      .add_event(3, zone_entered, {.object = "hall"});
  const Grade grade = session.grade();
  EXPECT_EQ(grade.awarded, 100);
  EXPECT_EQ(grade.deducted, 140);
  EXPECT_EQ(grade.score, 0);
  EXPECT_EQ(grade.fraction, 0);
  EXPECT_EQ(grade.grade, "");
}

TEST(ScoresByHand, TheTimeLimitOfATaskStartsWithTheTask) {
  for (const bool in_order : {true, false}) {
    SyntheticSession session(std::string("  order: ") + (in_order ? "listed" : "free") +
                             "\n"
                             "  tasks:\n"
                             "    - {name: a, points: 1, limit: 10 s, done: {reach: a}}\n"
                             "    - {name: b, points: 2, limit: 10 s, done: {reach: b}}\n");
    session.add_event(8, zone_entered, {.object = "a"}).add_event(16, zone_entered, {.object = "b"});
    EXPECT_EQ(session.score(), in_order ? 3 : 1) << "8 s for b, or 16 s";
  }
}

TEST(ScoresByHand, ATimedOutTaskIsFollowedByTheNext) {
  SyntheticSession session(
      "  tasks:\n"
      "    - {name: a, points: 1, limit: 10 s, done: {reach: a}}\n"
      "    - {name: b, points: 2, limit: 10 s, done: {reach: b}}\n");
  session.world(12).add_event(13, zone_entered, {.object = "a"}).add_event(22, zone_entered, {.object = "b"});
  EXPECT_EQ(session.outcome(0), TaskOutcome::out_of_time);
  EXPECT_EQ(session.score(), 2) << "b began at 12 s";
}

TEST(ScoresByHand, TheTotalTimeLimitFailsUnfinishedTasks) {
  SyntheticSession session(
      "  limit: 60 s\n"
      "  tasks:\n"
      "    - {name: a, points: 1, done: {reach: a}}\n"
      "    - {name: b, points: 2, done: {reach: b}}\n"
      "    - {name: c, points: 4, done: {reach: c}}\n");
  session.add_event(20, zone_entered, {.object = "a"}).add_event(60, zone_entered, {.object = "b"});
  session.add_event(60.25, zone_entered, {.object = "c"});
  EXPECT_EQ(session.score(), 1 + 2);
  EXPECT_EQ(session.outcome(2), TaskOutcome::out_of_time);
  EXPECT_TRUE(session.grade().complete);
}

TEST(ScoresByHand, TheNextTaskStartsAfterAFailedOne) {
  SyntheticSession session(
      "  tasks:\n"
      "    - {name: a, points: 1, done: {reach: a}, failed: {event: hazard_triggered, subject: any}}\n"
      "    - {name: b, points: 2, done: {reach: b}}\n");
  session.add_event(1, hazard_triggered, {.object = "rover", .subject = "mine"});
  session.add_event(2, zone_entered, {.object = "a"}).add_event(3, zone_entered, {.object = "b"});
  EXPECT_EQ(session.outcome(0), TaskOutcome::failed);
  EXPECT_EQ(session.grade().tasks[0].cause->subject, "mine");
  EXPECT_EQ(session.score(), 2);
}

TEST(ScoresByHand, SimultaneousSuccessAndFailureIsFailure) {
  SyntheticSession session(
      "  tasks: [{name: a, points: 1, done: {event: placed}, failed: {event: placed, object: bin}}]\n");
  session.add_event(1, placed, {.object = "bin"});
  EXPECT_EQ(session.outcome(0), TaskOutcome::failed);
  EXPECT_EQ(session.score(), 0);
}

TEST(ScoresByHand, ARequiredTaskOverridesAnyFraction) {
  for (const bool required : {true, false}) {
    SyntheticSession session(std::string("  order: free\n"
                                         "  pass_mark: 0.5\n"
                                         "  tasks:\n"
                                         "    - {name: a, points: 90, done: {reach: a}}\n"
                                         "    - {name: b, points: 10, done: {reach: b}, required: ") +
                             (required ? "true" : "false") + "}\n");
    session.add_event(1, zone_entered, {.object = "a"}).closes(9);
    EXPECT_EQ(session.grade().fraction, 0.9);
    EXPECT_EQ(session.grade().passed, !required);
  }
}

TEST(ScoresByHand, PassesAtTheFractionOfThePassMark) {
  for (const double cost : {2.0, 2.25}) {
    SyntheticSession session(
        "  pass_mark: 0.75\n"
        "  grades: [{name: A, from: 0.875}, {name: B, from: 0.75}, {name: C, from: 0.5}]\n"
        "  tasks: [{name: a, points: 8, done: {reach: a}}]\n"
        "  penalties: [{name: hit, per_impulse: 1, when: {event: contact_started}}]\n");
    session.add_event(1, contact_started, {.impulse = cost}).add_event(2, zone_entered, {.object = "a"});
    const Grade grade = session.grade();  // 6 of 8, or 5.75 of 8
    EXPECT_EQ(grade.fraction, cost > 2 ? 0.71875 : 0.75);
    EXPECT_EQ(grade.passed, cost <= 2);
    EXPECT_EQ(grade.grade, cost > 2 ? "C" : "B");
  }
}

TEST(ScoresByHand, ATaskMayHaveZeroPoints) {
  SyntheticSession session("  tasks: [{name: a, points: 0, required: true, done: {reach: a}}]\n");
  EXPECT_FALSE(session.grade().passed);
  session.add_event(1, zone_entered, {.object = "a"});
  EXPECT_EQ(session.grade().max, 0);
  EXPECT_EQ(session.grade().fraction, 0);
  EXPECT_TRUE(session.grade().passed);
}

TEST(ScoresByHand, TheNamedRobotIsGraded) {
  SyntheticSession session("  robot: robot_2\n" + kHall +
                           "  penalties: [{name: hit, points: 5, when: {event: contact_started}}]\n");
  session.add_event(1, contact_started, {.object = "wall 1"});
  session.add_event(2, contact_started, {.object = "rover", .subject = "robot_2"});
  session.add_event(3, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 0);
  session.add_event(4, zone_entered, {.object = "hall", .subject = "robot_2"});
  EXPECT_EQ(session.score(), 100 - 5) << "the first was the rover's own affair";
}

TEST(ScoresByHand, ATruncatedLogKeepsTasksAndDeductions) {
  SyntheticSession session(
      "  pass_mark: 0.25\n"
      "  tasks:\n"
      "    - {name: a, points: 40, done: {reach: a}}\n"
      "    - {name: follow, points: 60, done: {near: person_1, distance: 2 m, for: 5 s}}\n"
      "  penalties: [{name: hit, points: 5, when: {event: contact_started}}]\n");
  session.add_event(1, zone_entered, {.object = "a"}).add_event(2, contact_started);
  session.world(3, {{"rover"}, {"person_1", 1}}).world(7.75, {{"rover"}, {"person_1", 1}});
  const Grade grade = session.grade();
  EXPECT_EQ(grade.score, 35) << "4.75 s of following are none";
  EXPECT_EQ(grade.fraction, 0.35);
  EXPECT_TRUE(grade.passed) << "nothing that is required is missing";
  EXPECT_FALSE(grade.complete);
  EXPECT_EQ(grade.tasks[1].outcome, TaskOutcome::open);
  EXPECT_EQ(grade.end, SyntheticSession::at(7.75));
}

TEST(ScoresByHand, AStoppedSessionIsCompleteWithUnfinishedTasks) {
  SyntheticSession session(
      "  tasks:\n"
      "    - {name: a, points: 40, done: {reach: a}}\n"
      "    - {name: b, points: 60, done: {reach: b}}\n");
  session.add_event(1, zone_entered, {.object = "a"}).closes(30);
  const Grade grade = session.grade();
  EXPECT_TRUE(grade.complete);
  EXPECT_FALSE(grade.ended);
  EXPECT_EQ(grade.score, 40);
  EXPECT_EQ(grade.end, SyntheticSession::at(30));
}

TEST(ScoresByHand, ANewSessionHasNoPointsAndIsNotOver) {
  SyntheticSession session("  pass_mark: 0.5\n" + kHall);
  const Grade grade = session.grade();
  EXPECT_EQ(grade.score, 0);
  EXPECT_EQ(grade.max, 100);
  EXPECT_FALSE(grade.passed || grade.ended || grade.complete);
  EXPECT_EQ(grade.tasks[0].outcome, TaskOutcome::open);
  EXPECT_EQ(grade.end, grade.begin);
}

}  // namespace
}  // namespace parhelion::training
