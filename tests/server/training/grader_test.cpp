// Scores computed by hand.
#include "tests/server/training/grader_fixture.hpp"

namespace parhelion::training {
namespace {

using test::at, test::join, test::never, test::of, test::on, test::penalty, test::task, test::within;
using Kind = Condition::Kind;
using GraderTest = test::GraderTest;

TEST_F(GraderTest, ScoreIsPointsOfDoneTasksMinusPenalties) {
  training_.tasks = {task("into the hall", 60, of(Kind::reach, "hall")),
                     task("up", 40, of(Kind::climb, "stairs 1"))};
  training_.penalties = {penalty("collision", 5, on(EventKind::contact_started))};
  training_.penalties[0].per_impulse = 0.5;
  training_.pass_mark = 0.5;
  training_.grades = {{"A", 0.9}, {"B", 0.5}};
  start();
  add_event(3, EventKind::contact_started, "wall 1", 4);
  add_event(8, EventKind::zone_entered, "hall");
  add_event(20, EventKind::step_climbed, "step 1");
  add_event(21, EventKind::step_climbed, "step 2");
  EXPECT_EQ(outcome(1), TaskOutcome::open);
  add_event(22, EventKind::step_climbed, "step 3");
  const Grade grade = grader_->grade();
  EXPECT_EQ(grade.awarded, 100);
  EXPECT_EQ(grade.deducted, 5 + 0.5 * 4);
  EXPECT_EQ(grade.score, 93);
  EXPECT_EQ(grade.fraction, 0.93);
  EXPECT_EQ(grade.grade, "A");
  EXPECT_TRUE(grade.passed);
  EXPECT_TRUE(grade.ended);
  EXPECT_TRUE(grade.complete);
  // Each deduction has its event, rule and instant.
  ASSERT_EQ(grade.deductions.size(), 1U);
  EXPECT_EQ(grade.deductions[0].at, at(3));
  EXPECT_EQ(grade.deductions[0].rule, "collision");
  EXPECT_EQ(grade.deductions[0].cause->object, "wall 1");
  EXPECT_EQ(grade.tasks[0].ended, at(8));
  EXPECT_EQ(grade.tasks[1].began, at(8)) << "in order";
  EXPECT_EQ(grade.tasks[1].cause->object, "step 3");
}

TEST_F(GraderTest, UnsensedEventsAreNeverScored) {
  training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
  training_.penalties = {penalty("collision", 5, on(EventKind::contact_started))};
  start();
  Event event;
  event.stamp = at(1);
  event.kind = EventKind::contact_started;
  event.subject = "rover";
  event.undetectable = true;
  grader_->take(event);
  EXPECT_TRUE(grader_->grade().deductions.empty());
}

TEST_F(GraderTest, AContactCountsForBothBodies) {
  training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
  training_.penalties = {penalty("person", 20, on(EventKind::contact_started, "person_1"))};
  start();
  add_event(1, EventKind::contact_started, "rover", 1, 0, "person_1");
  add_event(2, EventKind::contact_started, "crate", 1, 0, "person_1");  // not the graded robot's
  ASSERT_EQ(grader_->grade().deductions.size(), 1U);
  EXPECT_EQ(grader_->grade().deductions[0].at, at(1));
}

TEST_F(GraderTest, APenaltyIsLimitedToItsMaximum) {
  training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
  training_.penalties = {penalty("bump", 4, on(EventKind::contact_started))};
  training_.penalties[0].max = 10;
  start();
  for (int i = 1; i <= 5; ++i) add_event(i, EventKind::contact_started, "wall 1");
  const Grade grade = grader_->grade();
  ASSERT_EQ(grade.deductions.size(), 3U);
  EXPECT_EQ(grade.deducted, 10);
  EXPECT_EQ(grade.deductions[2].points, 2);
  EXPECT_EQ(grade.score, 0) << "never below nothing";
}

TEST_F(GraderTest, ADoorIsPassedFromOneSideToTheOther) {
  training_.tasks = {task("through", 10, of(Kind::pass, "door 1"))};
  start();
  add_event(1, EventKind::door_space_entered, "door 1", 0, -0.5);
  add_event(2, EventKind::door_space_left, "door 1", 0, -0.6);  // back again
  EXPECT_EQ(outcome(), TaskOutcome::open);
  add_event(3, EventKind::door_space_entered, "door 1", 0, -0.5);
  add_event(5, EventKind::door_space_left, "door 1", 0, 0.6);
  EXPECT_EQ(outcome(), TaskOutcome::done);
}

TEST_F(GraderTest, PassingWithoutContactFailsOnFrameContact) {
  training_.tasks = {
      task("clean", 10, never(of(Kind::pass, "door 1"), on(EventKind::contact_started, "door 1")))};
  start();
  add_event(1, EventKind::door_space_entered, "door 1", 0, -0.5);
  add_event(1.5, EventKind::contact_started, "wall 1");
  EXPECT_EQ(outcome(), TaskOutcome::open);
  add_event(2, EventKind::contact_started, "door 1");
  EXPECT_EQ(outcome(), TaskOutcome::failed);
  add_event(3, EventKind::door_space_left, "door 1", 0, 0.6);
  EXPECT_EQ(grader_->grade().awarded, 0);
}

TEST_F(GraderTest, TimeExpiresAfterTheLimitNotAtIt) {
  for (const double t : {10.0, 10.001}) {
    training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
    training_.tasks[0].limit = 10;
    start();
    add_event(t, EventKind::zone_entered, "hall");
    EXPECT_EQ(outcome(), t > 10 ? TaskOutcome::out_of_time : TaskOutcome::done);
  }
}

TEST_F(GraderTest, EventsAfterTheTimeLimitChangeNothing) {
  training_.limit = 30;
  training_.tasks = {task("a", 10, of(Kind::reach, "a")), task("b", 10, of(Kind::reach, "b"))};
  training_.penalties = {penalty("bump", 4, on(EventKind::contact_started))};
  start();
  add_event(5, EventKind::zone_entered, "a");
  stand(31, 0);
  add_event(32, EventKind::zone_entered, "b");
  add_event(33, EventKind::contact_started, "wall 1");
  const Grade grade = grader_->grade();
  EXPECT_EQ(grade.score, 10);
  EXPECT_EQ(grade.tasks[1].outcome, TaskOutcome::out_of_time);
  EXPECT_EQ(grade.end, at(30));
  EXPECT_TRUE(grade.complete);
}

TEST_F(GraderTest, FreeTasksHaveAnyOrderAndOrderedTasksWait) {
  for (const bool in_order : {true, false}) {
    training_.in_order = in_order;
    training_.tasks = {task("a", 10, of(Kind::reach, "a")), task("b", 10, on(EventKind::gripped, "crate"))};
    start();
    add_event(1, EventKind::gripped, "crate");
    add_event(2, EventKind::zone_entered, "a");
    EXPECT_EQ(grader_->grade().awarded, in_order ? 10 : 20);
  }
}

TEST_F(GraderTest, ASequenceMustCompleteWithinItsTime) {
  training_.tasks = {
      task("lift and place", 10,
           join(Kind::then, {on(EventKind::lifted, "crate"), within(on(EventKind::placed), 20)}))};
  start();
  add_event(1, EventKind::placed);  // too early to count
  add_event(2, EventKind::lifted, "crate");
  EXPECT_EQ(outcome(), TaskOutcome::open);
  add_event(22, EventKind::placed);
  EXPECT_EQ(outcome(), TaskOutcome::done);
  start();
  add_event(2, EventKind::lifted, "crate");
  add_event(22.1, EventKind::placed);
  EXPECT_EQ(outcome(), TaskOutcome::failed);
}

TEST_F(GraderTest, AllNeedsEachAndAnyNeedsOne) {
  const std::vector<Condition> parts{of(Kind::reach, "a"), within(of(Kind::reach, "b"), 5)};
  training_.in_order = false;
  training_.tasks = {task("all", 1, join(Kind::all, parts)), task("any", 2, join(Kind::any, parts))};
  start();
  stand(6, 0);  // b is lost
  EXPECT_EQ(outcome(0), TaskOutcome::failed);
  EXPECT_EQ(outcome(1), TaskOutcome::open);
  add_event(7, EventKind::zone_entered, "a");
  EXPECT_EQ(outcome(1), TaskOutcome::done);
}

TEST_F(GraderTest, FollowingRequiresContinuousNearness) {
  training_.tasks = {task("follow", 10, of(Kind::near, "person_1", 2, 3))};
  start();
  stand(0, 0, 0, 0, {{"person_1", {1.9, 0}}});
  stand(2, 0, 0, 0, {{"person_1", {2.5, 0}}});  // lost
  stand(3, 0, 0, 0, {{"person_1", {1.5, 0}}});
  stand(5.9, 0, 0, 0, {{"person_1", {1.5, 0}}});
  EXPECT_EQ(outcome(), TaskOutcome::open);
  stand(6, 0, 0, 0, {{"person_1", {1.5, 0}}});
  EXPECT_EQ(outcome(), TaskOutcome::done);
}

TEST_F(GraderTest, EachApproachThatIsTooCloseIsPenalizedOnce) {
  training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
  training_.penalties = {penalty("too near", 3, of(Kind::near, "person_1", 1))};
  start();
  for (int i = 0; i < 5; ++i) stand(0.1 * i, 0, 0, 0, {{"person_1", {0.5, 0}}});
  EXPECT_EQ(grader_->grade().deductions.size(), 1U);
  stand(1, 0, 0, 0, {{"person_1", {3, 0}}});
  stand(2, 0, 0, 0, {{"person_1", {0.5, 0}}});
  EXPECT_EQ(grader_->grade().deductions.size(), 2U);
}

TEST_F(GraderTest, StandingStillRestartsWithEachMovement) {
  training_.tasks = {task("hold still", 10, of(Kind::still, "", 0, 5))};
  start();
  add_event(0, EventKind::movement_started);
  add_event(2, EventKind::movement_stopped);
  add_event(6, EventKind::movement_started);
  add_event(7, EventKind::movement_stopped);
  stand(11.9, 0);
  EXPECT_EQ(outcome(), TaskOutcome::open);
  stand(12, 0);
  EXPECT_EQ(outcome(), TaskOutcome::done);
}

TEST_F(GraderTest, InspectingNeedsTheObjectVisibleAndNear) {
  training_.tasks = {task("inspect", 10, of(Kind::inspect, "gauge", 3, 1))};
  const auto seen_from = [&](double x, double y, double yaw, Eigen::Vector2d gauge) {
    start();
    for (int i = 0; i <= 10; ++i) stand(0.1 * i, x, y, yaw, {{"gauge", gauge}});
    return outcome() == TaskOutcome::done;
  };
  EXPECT_TRUE(seen_from(-4, 0, 0, {-2, 0}));
  EXPECT_FALSE(seen_from(-6, 0, 0, {-2, 0})) << "too far";
  EXPECT_FALSE(seen_from(-4, 0, 2, {-2, 0})) << "looks away";
  EXPECT_FALSE(seen_from(-1, 3, 0, {1, 3})) << "behind the wall";
  EXPECT_FALSE(seen_from(-1, 0, 0, {1, 0})) << "behind the door";
}

TEST_F(GraderTest, ALogThatStopsInTheMiddleIsGradedAsFarAsItGoes) {
  training_.tasks = {task("a", 10, of(Kind::reach, "a")), task("b", 10, of(Kind::reach, "b"))};
  training_.pass_mark = 0.4;
  training_.tasks[1].required = true;
  start();
  add_event(1, EventKind::zone_entered, "a");
  stand(9, 0);
  Grade grade = grader_->grade();
  EXPECT_EQ(grade.score, 10);
  EXPECT_FALSE(grade.complete);
  EXPECT_FALSE(grade.passed) << "what is required is not done";
  EXPECT_EQ(grade.end, at(9));
  grader_->close(at(10));
  grade = grader_->grade();
  EXPECT_TRUE(grade.complete);
  EXPECT_FALSE(grade.ended);
}

TEST_F(GraderTest, AZoneIsReachedIfTheRobotStartsInside) {
  training_.tasks = {task("first", 10, on(EventKind::gripped)),
                     task("be in the hall", 10, of(Kind::reach, "hall"))};
  start();
  add_event(1, EventKind::zone_entered, "hall");
  add_event(2, EventKind::gripped, "crate");
  stand(2.1, 0);
  EXPECT_EQ(outcome(1), TaskOutcome::done);
}

}  // namespace
}  // namespace parhelion::training
