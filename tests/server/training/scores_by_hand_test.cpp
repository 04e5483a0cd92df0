// Small scenarios as a user writes them, each with its score computed by hand: penalties, limits, order, pass
// marks, and truncated logs.
#include "tests/server/training/told_session.hpp"

namespace parhelion::training {
namespace {

using enum EventKind;
using test::ToldSession;

const std::string hall = "  tasks: [{name: hall, points: 100, done: {reach: hall}}]\n";

TEST(ScoresByHand, PointsOfAPenaltyAreThoseOfEachTimeAndOfItsImpulse) {
  ToldSession session(
      hall + "  penalties: [{name: hit, points: 3, per_impulse: 0.5, when: {event: collision_started}}]\n");
  session.says(1, collision_started, {.object = "wall 1", .impulse = 4});
  session.says(2, collision_started, {.object = "crate", .impulse = 0.5});
  session.says(3, zone_entered, {.object = "hall"});
  // 3 + 0.5 * 4 = 5, and 3 + 0.5 * 0.5 = 3.25
  EXPECT_EQ(session.grade().charges[0].points, 5);
  EXPECT_EQ(session.grade().charges[1].points, 3.25);
  EXPECT_EQ(session.score(), 100 - 8.25);
}

TEST(ScoresByHand, TheMostOfAPenaltyCutsTheChargeThatReachesIt) {
  ToldSession session(
      hall +
      "  penalties: [{name: hit, points: 3, per_impulse: 1, most: 10, when: {event: collision_started}}]\n");
  for (const double impulse : {2.0, 4.0, 1.0})
    session.says(impulse, collision_started, {.object = "wall 1", .impulse = impulse});
  session.says(9, zone_entered, {.object = "hall"});
  // 3 + 2 = 5; 3 + 4 = 7 of which 10 - 5 = 5 are left; then nothing
  ASSERT_EQ(session.grade().charges.size(), 2U);
  EXPECT_EQ(session.grade().charges[1].points, 5);
  EXPECT_EQ(session.score(), 90);
}

TEST(ScoresByHand, APenaltyByImpulseAloneCostsNothingForATouchWithoutOne) {
  ToldSession session(hall +
                      "  penalties: [{name: hit, per_impulse: 2, when: {event: collision_started}}]\n");
  session.says(1, collision_started, {.object = "wall 1"});
  session.says(2, collision_started, {.object = "wall 1", .impulse = 1.5});
  session.says(3, zone_entered, {.object = "hall"});
  ASSERT_EQ(session.grade().charges.size(), 1U);
  EXPECT_EQ(session.score(), 100 - 3);
}

TEST(ScoresByHand, TwoRulesMayChargeForOneEvent) {
  ToldSession session(
      hall +
      "  penalties:\n"
      "    - {name: any touch, points: 5, when: {event: collision_started}}\n"
      "    - {name: person, points: 30, when: {event: collision_started, object: person_1}}\n");
  session.says(1, collision_started, {.object = "person_1"}).says(2, collision_started, {.object = "crate"});
  session.says(3, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - (5 + 30) - 5);
}

TEST(ScoresByHand, AContactThatGoesOnIsAnotherEventThanItsBegin) {
  ToldSession session(hall +
                      "  penalties:\n"
                      "    - {name: touch, points: 5, when: {event: collision_started}}\n"
                      "    - {name: push, points: 1, when: {event: collision_continued, impulse: 3 N s}}\n");
  session.says(1, collision_started, {.object = "crate"});
  for (const double impulse : {1.0, 3.0, 5.0})
    session.says(1 + impulse / 8, collision_continued, {.object = "crate", .impulse = impulse});
  session.says(2, collision_stopped, {.object = "crate"}).says(3, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 5 - 2 * 1);
}

TEST(ScoresByHand, WhatTheRobotCouldNotSenseNeitherCostsNorFailsNorCounts) {
  ToldSession session(
      "  order: free\n"
      "  tasks:\n"
      "    - {name: clean, points: 50, done: {reach: hall, never: {event: collision_started}}}\n"
      "    - {name: touches, points: 50, done: {event: collision_started, count: 2}}\n"
      "  penalties: [{name: hit, points: 5, when: {event: collision_started}}]\n");
  session.says(1, collision_started, {.object = "robot_1", .unsensed = true});
  session.says(2, zone_entered, {.object = "hall"});
  session.says(3, collision_started, {.object = "robot_1"});
  EXPECT_EQ(session.score(), 50 - 5);
  session.says(4, collision_started, {.object = "robot_1", .unsensed = true});
  EXPECT_EQ(session.score(), 50 - 5) << "one of two";
}

TEST(ScoresByHand, ACountIsCountedAnewEachTimeThatItWasReached) {
  ToldSession session(
      hall + "  penalties: [{name: bumps, points: 4, when: {event: collision_started, count: 3}}]\n");
  for (int i = 1; i <= 7; ++i) session.says(i, collision_started, {.object = "wall 1"});
  session.says(9, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 2 * 4) << "3 + 3 + 1 bumps";
}

TEST(ScoresByHand, ASequenceCostsEachTimeThatItIsWhole) {
  ToldSession session(
      hall + "  penalties: [{name: lost, points: 6, when: {then: [{event: lifted}, {event: dropped}]}}]\n");
  session.says(1, dropped).says(2, lifted).says(3, dropped).says(4, dropped).says(5, lifted).says(6, dropped);
  session.says(9, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 2 * 6) << "lifted and dropped at 3 and at 6";
}

TEST(ScoresByHand, ASequenceThatCameTooLateIsWatchedForAnew) {
  ToldSession session(hall +
                      "  penalties: [{name: lost, points: 6, when: {then: [{event: lifted}, {event: dropped, "
                      "within: 2 s}]}}]\n");
  session.says(1, lifted).says(5, dropped).says(6, lifted).says(7, dropped);
  session.says(9, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 6) << "4 s, then 1 s";
}

TEST(ScoresByHand, IdlingCostsOnceForEachPause) {
  ToldSession session(hall + "  penalties: [{name: idle, points: 2, when: {still: 5 s}}]\n");
  session.says(0, movement_started).says(1, movement_stopped).world(6).world(20).world(40);
  session.says(41, movement_started).says(42, movement_stopped).world(46.75);
  session.says(47, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 2 * 2) << "from 1 s to 41 s, and from 42 s to 47 s";
}

TEST(ScoresByHand, EnteringAZoneAgainCostsAgainStayingDoesNot) {
  ToldSession session(hall + "  penalties: [{name: danger, points: 7, when: {reach: danger}}]\n");
  session.says(1, zone_entered, {.object = "danger"})
      .world(2)
      .world(3)
      .says(4, zone_left, {.object = "danger"});
  session.says(5, zone_entered, {.object = "danger"}).world(6);
  session.says(7, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 100 - 2 * 7);
}

TEST(ScoresByHand, NothingIsChargedOnceAllIsDone) {
  ToldSession session(hall + "  penalties: [{name: hit, points: 5, when: {event: collision_started}}]\n");
  session.says(1, collision_started, {.object = "wall 1"}).says(2, zone_entered, {.object = "hall"});
  session.says(3, collision_started, {.object = "wall 1"});
  EXPECT_EQ(session.score(), 95);
  EXPECT_EQ(session.grade().end, ToldSession::at(2));
}

TEST(ScoresByHand, AScoreIsNeverBelowNothing) {
  ToldSession session(hall +
                      "  grades: [{name: A, from: 0.5}]\n"
                      "  penalties: [{name: hit, points: 70, when: {event: collision_started}}]\n");
  session.says(1, collision_started).says(2, collision_started).says(3, zone_entered, {.object = "hall"});
  const Grade grade = session.grade();
  EXPECT_EQ(grade.earned, 100);
  EXPECT_EQ(grade.charged, 140);
  EXPECT_EQ(grade.score, 0);
  EXPECT_EQ(grade.share, 0);
  EXPECT_EQ(grade.grade, "");
}

TEST(ScoresByHand, TheLimitOfATaskIsFromItsOwnBegin) {
  for (const bool in_order : {true, false}) {
    ToldSession session(std::string("  order: ") + (in_order ? "listed" : "free") +
                        "\n"
                        "  tasks:\n"
                        "    - {name: a, points: 1, limit: 10 s, done: {reach: a}}\n"
                        "    - {name: b, points: 2, limit: 10 s, done: {reach: b}}\n");
    session.says(8, zone_entered, {.object = "a"}).says(16, zone_entered, {.object = "b"});
    EXPECT_EQ(session.score(), in_order ? 3 : 1) << "8 s for b, or 16 s";
  }
}

TEST(ScoresByHand, WhoRunsOutOfTimeInOneTaskGoesOnToTheNext) {
  ToldSession session(
      "  tasks:\n"
      "    - {name: a, points: 1, limit: 10 s, done: {reach: a}}\n"
      "    - {name: b, points: 2, limit: 10 s, done: {reach: b}}\n");
  session.world(12).says(13, zone_entered, {.object = "a"}).says(22, zone_entered, {.object = "b"});
  EXPECT_EQ(session.outcome(0), TaskOutcome::out_of_time);
  EXPECT_EQ(session.score(), 2) << "b began at 12 s";
}

TEST(ScoresByHand, TheLimitOfTheWholeTakesWhatHasNotBeenDone) {
  ToldSession session(
      "  limit: 60 s\n"
      "  tasks:\n"
      "    - {name: a, points: 1, done: {reach: a}}\n"
      "    - {name: b, points: 2, done: {reach: b}}\n"
      "    - {name: c, points: 4, done: {reach: c}}\n");
  session.says(20, zone_entered, {.object = "a"}).says(60, zone_entered, {.object = "b"});
  session.says(60.25, zone_entered, {.object = "c"});
  EXPECT_EQ(session.score(), 1 + 2);
  EXPECT_EQ(session.outcome(2), TaskOutcome::out_of_time);
  EXPECT_TRUE(session.grade().complete);
}

TEST(ScoresByHand, ATaskThatFailedGivesWayToTheNext) {
  ToldSession session(
      "  tasks:\n"
      "    - {name: a, points: 1, done: {reach: a}, failed: {event: hazard_set_off, subject: any}}\n"
      "    - {name: b, points: 2, done: {reach: b}}\n");
  session.says(1, hazard_set_off, {.object = "rover", .subject = "mine"});
  session.says(2, zone_entered, {.object = "a"}).says(3, zone_entered, {.object = "b"});
  EXPECT_EQ(session.outcome(0), TaskOutcome::failed);
  EXPECT_EQ(session.grade().tasks[0].cause->subject, "mine");
  EXPECT_EQ(session.score(), 2);
}

TEST(ScoresByHand, FailingAndDoingAtOnceIsFailing) {
  ToldSession session(
      "  tasks: [{name: a, points: 1, done: {event: placed}, failed: {event: placed, object: bin}}]\n");
  session.says(1, placed, {.object = "bin"});
  EXPECT_EQ(session.outcome(0), TaskOutcome::failed);
  EXPECT_EQ(session.score(), 0);
}

TEST(ScoresByHand, WhatIsRequiredDecidesOverAnyShare) {
  for (const bool required : {true, false}) {
    ToldSession session(std::string("  order: free\n"
                                    "  pass_mark: 0.5\n"
                                    "  tasks:\n"
                                    "    - {name: a, points: 90, done: {reach: a}}\n"
                                    "    - {name: b, points: 10, done: {reach: b}, required: ") +
                        (required ? "true" : "false") + "}\n");
    session.says(1, zone_entered, {.object = "a"}).closes(9);
    EXPECT_EQ(session.grade().share, 0.9);
    EXPECT_EQ(session.grade().passed, !required);
  }
}

TEST(ScoresByHand, TheMarkIsPassedAtItsShareAndMissedBelowIt) {
  for (const double cost : {2.0, 2.25}) {
    ToldSession session(
        "  pass_mark: 0.75\n"
        "  grades: [{name: A, from: 0.875}, {name: B, from: 0.75}, {name: C, from: 0.5}]\n"
        "  tasks: [{name: a, points: 8, done: {reach: a}}]\n"
        "  penalties: [{name: hit, per_impulse: 1, when: {event: collision_started}}]\n");
    session.says(1, collision_started, {.impulse = cost}).says(2, zone_entered, {.object = "a"});
    const Grade grade = session.grade();  // 6 of 8, or 5.75 of 8
    EXPECT_EQ(grade.share, cost > 2 ? 0.71875 : 0.75);
    EXPECT_EQ(grade.passed, cost <= 2);
    EXPECT_EQ(grade.grade, cost > 2 ? "C" : "B");
  }
}

TEST(ScoresByHand, ATaskOfNoPointsIsDoneForItsOwnSake) {
  ToldSession session("  tasks: [{name: a, points: 0, required: true, done: {reach: a}}]\n");
  EXPECT_FALSE(session.grade().passed);
  session.says(1, zone_entered, {.object = "a"});
  EXPECT_EQ(session.grade().most, 0);
  EXPECT_EQ(session.grade().share, 0);
  EXPECT_TRUE(session.grade().passed);
}

TEST(ScoresByHand, TheRobotThatIsNamedIsGraded) {
  ToldSession session("  robot: robot_2\n" + hall +
                      "  penalties: [{name: hit, points: 5, when: {event: collision_started}}]\n");
  session.says(1, collision_started, {.object = "wall 1"});
  session.says(2, collision_started, {.object = "rover", .subject = "robot_2"});
  session.says(3, zone_entered, {.object = "hall"});
  EXPECT_EQ(session.score(), 0);
  session.says(4, zone_entered, {.object = "hall", .subject = "robot_2"});
  EXPECT_EQ(session.score(), 100 - 5) << "the first was the rover's own affair";
}

TEST(ScoresByHand, ALogThatStopsKeepsWhatWasDoneAndCharged) {
  ToldSession session(
      "  pass_mark: 0.25\n"
      "  tasks:\n"
      "    - {name: a, points: 40, done: {reach: a}}\n"
      "    - {name: follow, points: 60, done: {near: person_1, distance: 2 m, for: 5 s}}\n"
      "  penalties: [{name: hit, points: 5, when: {event: collision_started}}]\n");
  session.says(1, zone_entered, {.object = "a"}).says(2, collision_started);
  session.world(3, {{"rover"}, {"person_1", 1}}).world(7.75, {{"rover"}, {"person_1", 1}});
  const Grade grade = session.grade();
  EXPECT_EQ(grade.score, 35) << "4.75 s of following are none";
  EXPECT_EQ(grade.share, 0.35);
  EXPECT_TRUE(grade.passed) << "nothing that is required is missing";
  EXPECT_FALSE(grade.complete);
  EXPECT_EQ(grade.tasks[1].outcome, TaskOutcome::open);
  EXPECT_EQ(grade.end, ToldSession::at(7.75));
}

TEST(ScoresByHand, ASessionThatWasStoppedOnPurposeIsWholeWithoutBeingDone) {
  ToldSession session(
      "  tasks:\n"
      "    - {name: a, points: 40, done: {reach: a}}\n"
      "    - {name: b, points: 60, done: {reach: b}}\n");
  session.says(1, zone_entered, {.object = "a"}).closes(30);
  const Grade grade = session.grade();
  EXPECT_TRUE(grade.complete);
  EXPECT_FALSE(grade.ended);
  EXPECT_EQ(grade.score, 40);
  EXPECT_EQ(grade.end, ToldSession::at(30));
}

TEST(ScoresByHand, BeforeAnythingHappensThereIsNothingAndNothingIsOver) {
  ToldSession session("  pass_mark: 0.5\n" + hall);
  const Grade grade = session.grade();
  EXPECT_EQ(grade.score, 0);
  EXPECT_EQ(grade.most, 100);
  EXPECT_FALSE(grade.passed || grade.ended || grade.complete);
  EXPECT_EQ(grade.tasks[0].outcome, TaskOutcome::open);
  EXPECT_EQ(grade.end, grade.begin);
}

}  // namespace
}  // namespace parhelion::training
