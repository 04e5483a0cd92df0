// Scores worked out by hand.
#include "server/training/grader.hpp"

#include <gtest/gtest.h>

#include "tests/model_box.hpp"

namespace parhelion {
namespace {

using Kind = Condition::Kind;
using test::model_box;

SimulationTime at(double t) { return SimulationTime{1'000'000'000'000} + seconds(t); }

Condition on(EventKind kind, const std::string& object = {}) {
  Condition condition;
  condition.event = kind;
  condition.object = object;
  return condition;
}

Condition of(Kind kind, const std::string& target, double distance = 0, double duration = 0) {
  Condition condition;
  condition.kind = kind;
  condition.target = target;
  condition.distance = distance;
  condition.duration = duration;
  return condition;
}

Condition join(Kind kind, std::vector<Condition> parts) {
  Condition condition;
  condition.kind = kind;
  condition.parts = std::move(parts);
  return condition;
}

Condition within(Condition condition, double time) {
  condition.within = time;
  return condition;
}

Condition never(Condition condition, Condition what) {
  condition.never = {std::move(what)};
  return condition;
}

Task task(const std::string& name, double points, Condition done) {
  Task made;
  made.name = name;
  made.points = points;
  made.done = std::move(done);
  return made;
}

Penalty penalty(const std::string& name, double points, Condition when) {
  Penalty made;
  made.name = name;
  made.points = points;
  made.when = std::move(when);
  return made;
}

/// Two rooms, a door between them at x = 0, a flight of three steps at x = 4.
SemanticModel site() {
  SemanticModel model;
  model.entities.push_back(model_box("door 1", EntityLabel::door, {0, 0, 1}, {1, 0.05, 2}));
  model.entities.back().T_map_body = Transform<Map, Body>(
      Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitZ())), {0, 0, 1});
  model.entities.push_back(model_box("wall 1", EntityLabel::wall, {0, 3, 1.25}, {0.1, 4, 2.5}));
  for (int i = 1; i <= 3; ++i) {
    model.entities.push_back(model_box("step " + std::to_string(i), EntityLabel::stairs,
                                       {4 + 0.3 * i, 0, 0.085 * i}, {0.3, 1, 0.17 * i}));
    model.entities.back().part_of = "stairs 1";
  }
  return model;
}

RobotDescription robot() {
  RobotDescription description;
  description.name = "rover";
  CameraDescription& camera = description.camera.emplace();
  camera.intrinsics.width = 640;
  camera.intrinsics.height = 480;
  camera.intrinsics.fx = camera.intrinsics.fy = 320;  // 90 degrees wide
  camera.intrinsics.cx = 320;
  camera.intrinsics.cy = 240;
  Eigen::Matrix3d R;  // optical axes: z ahead, x right, y down
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.T_base_optical = Transform<Base, CameraOptical>(Eigen::Quaterniond(R), {0, 0, 0.5});
  return description;
}

class GraderTest : public testing::Test {
 protected:
  void start() { grader_.emplace(training_, model_, robot_, "rover", at(0)); }

  void say(double t, EventKind kind, const std::string& object = {}, double impulse = 0, double x = 0,
           const std::string& subject = "rover") {
    Event event;
    event.stamp = at(t);
    event.kind = kind;
    event.subject = subject;
    event.object = object;
    event.impulse = impulse;
    event.position = {x, 0, 0};
    grader_->take(event);
  }
  void stand(double t, double x, double y = 0, double yaw = 0,
             std::vector<std::pair<std::string, Eigen::Vector2d>> others = {}) {
    WorldMessage world;
    world.stamp = {at(t).ns};
    world.bodies.emplace_back();
    world.bodies.back().entity = "rover";
    world.bodies.back().T_map_body = Transform<Map, Body>::planar(x, y, yaw, 0);
    for (const auto& [name, place] : others) {
      world.bodies.emplace_back();
      world.bodies.back().entity = name;
      world.bodies.back().T_map_body = Transform<Map, Body>::planar(place.x(), place.y(), 0, 0);
    }
    grader_->take(world);
  }
  TaskOutcome outcome(std::size_t i = 0) { return grader_->grade().tasks[i].outcome; }

  Training training_;
  SemanticModel model_ = site();
  RobotDescription robot_ = robot();
  std::optional<Grader> grader_;
};

TEST_F(GraderTest, PointsAreThoseOfTasksDoneLessPenalties) {
  training_.tasks = {task("into the hall", 60, of(Kind::reach, "hall")),
                     task("up", 40, of(Kind::climb, "stairs 1"))};
  training_.penalties = {penalty("collision", 5, on(EventKind::collision_started))};
  training_.penalties[0].per_impulse = 0.5;
  training_.pass_mark = 0.5;
  training_.grades = {{"A", 0.9}, {"B", 0.5}};
  start();
  say(3, EventKind::collision_started, "wall 1", 4);
  say(8, EventKind::zone_entered, "hall");
  say(20, EventKind::step_climbed, "step 1");
  say(21, EventKind::step_climbed, "step 2");
  EXPECT_EQ(outcome(1), TaskOutcome::open);
  say(22, EventKind::step_climbed, "step 3");
  const Grade grade = grader_->grade();
  EXPECT_EQ(grade.earned, 100);
  EXPECT_EQ(grade.charged, 5 + 0.5 * 4);
  EXPECT_EQ(grade.score, 93);
  EXPECT_EQ(grade.share, 0.93);
  EXPECT_EQ(grade.grade, "A");
  EXPECT_TRUE(grade.passed);
  EXPECT_TRUE(grade.ended);
  EXPECT_TRUE(grade.complete);
  // Each point has its event, rule and second.
  ASSERT_EQ(grade.charges.size(), 1U);
  EXPECT_EQ(grade.charges[0].at, at(3));
  EXPECT_EQ(grade.charges[0].rule, "collision");
  EXPECT_EQ(grade.charges[0].cause->object, "wall 1");
  EXPECT_EQ(grade.tasks[0].ended, at(8));
  EXPECT_EQ(grade.tasks[1].began, at(8)) << "in order";
  EXPECT_EQ(grade.tasks[1].cause->object, "step 3");
}

TEST_F(GraderTest, WhatIsUnsensedIsNeverScored) {
  training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
  training_.penalties = {penalty("collision", 5, on(EventKind::collision_started))};
  start();
  Event event;
  event.stamp = at(1);
  event.kind = EventKind::collision_started;
  event.subject = "rover";
  event.unsensed = true;
  grader_->take(event);
  EXPECT_TRUE(grader_->grade().charges.empty());
}

TEST_F(GraderTest, AContactIsOfBothWhoeverIsNamedFirst) {
  training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
  training_.penalties = {penalty("person", 20, on(EventKind::collision_started, "person_1"))};
  start();
  say(1, EventKind::collision_started, "rover", 1, 0, "person_1");
  say(2, EventKind::collision_started, "crate", 1, 0, "person_1");  // none of ours
  ASSERT_EQ(grader_->grade().charges.size(), 1U);
  EXPECT_EQ(grader_->grade().charges[0].at, at(1));
}

TEST_F(GraderTest, APenaltyTakesNoMoreThanItsMost) {
  training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
  training_.penalties = {penalty("bump", 4, on(EventKind::collision_started))};
  training_.penalties[0].most = 10;
  start();
  for (int i = 1; i <= 5; ++i) say(i, EventKind::collision_started, "wall 1");
  const Grade grade = grader_->grade();
  ASSERT_EQ(grade.charges.size(), 3U);
  EXPECT_EQ(grade.charged, 10);
  EXPECT_EQ(grade.charges[2].points, 2);
  EXPECT_EQ(grade.score, 0) << "never below nothing";
}

TEST_F(GraderTest, ADoorIsPassedFromOneSideToTheOther) {
  training_.tasks = {task("through", 10, of(Kind::pass, "door 1"))};
  start();
  say(1, EventKind::door_space_entered, "door 1", 0, -0.5);
  say(2, EventKind::door_space_left, "door 1", 0, -0.6);  // back again
  EXPECT_EQ(outcome(), TaskOutcome::open);
  say(3, EventKind::door_space_entered, "door 1", 0, -0.5);
  say(5, EventKind::door_space_left, "door 1", 0, 0.6);
  EXPECT_EQ(outcome(), TaskOutcome::done);
}

TEST_F(GraderTest, PassingWithoutTouchingTheFrameFailsAtTheTouch) {
  training_.tasks = {
      task("clean", 10, never(of(Kind::pass, "door 1"), on(EventKind::collision_started, "door 1")))};
  start();
  say(1, EventKind::door_space_entered, "door 1", 0, -0.5);
  say(1.5, EventKind::collision_started, "wall 1");
  EXPECT_EQ(outcome(), TaskOutcome::open);
  say(2, EventKind::collision_started, "door 1");
  EXPECT_EQ(outcome(), TaskOutcome::failed);
  say(3, EventKind::door_space_left, "door 1", 0, 0.6);
  EXPECT_EQ(grader_->grade().earned, 0);
}

TEST_F(GraderTest, TimeIsUpAfterTheLimitNotAtIt) {
  for (const double t : {10.0, 10.001}) {
    training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
    training_.tasks[0].limit = 10;
    start();
    say(t, EventKind::zone_entered, "hall");
    EXPECT_EQ(outcome(), t > 10 ? TaskOutcome::out_of_time : TaskOutcome::done);
  }
}

TEST_F(GraderTest, TheWholeEndsAtItsLimitAndWhatComesLaterChangesNothing) {
  training_.limit = 30;
  training_.tasks = {task("a", 10, of(Kind::reach, "a")), task("b", 10, of(Kind::reach, "b"))};
  training_.penalties = {penalty("bump", 4, on(EventKind::collision_started))};
  start();
  say(5, EventKind::zone_entered, "a");
  stand(31, 0);
  say(32, EventKind::zone_entered, "b");
  say(33, EventKind::collision_started, "wall 1");
  const Grade grade = grader_->grade();
  EXPECT_EQ(grade.score, 10);
  EXPECT_EQ(grade.tasks[1].outcome, TaskOutcome::out_of_time);
  EXPECT_EQ(grade.end, at(30));
  EXPECT_TRUE(grade.complete);
}

TEST_F(GraderTest, FreeTasksAreDoneInAnyOrderListedOnesWait) {
  for (const bool in_order : {true, false}) {
    training_.in_order = in_order;
    training_.tasks = {task("a", 10, of(Kind::reach, "a")), task("b", 10, on(EventKind::gripped, "crate"))};
    start();
    say(1, EventKind::gripped, "crate");
    say(2, EventKind::zone_entered, "a");
    EXPECT_EQ(grader_->grade().earned, in_order ? 10 : 20);
  }
}

TEST_F(GraderTest, OneAfterTheOtherWithinATime) {
  training_.tasks = {
      task("lift and place", 10,
           join(Kind::then, {on(EventKind::lifted, "crate"), within(on(EventKind::placed), 20)}))};
  start();
  say(1, EventKind::placed);  // too early to count
  say(2, EventKind::lifted, "crate");
  EXPECT_EQ(outcome(), TaskOutcome::open);
  say(22, EventKind::placed);
  EXPECT_EQ(outcome(), TaskOutcome::done);
  start();
  say(2, EventKind::lifted, "crate");
  say(22.1, EventKind::placed);
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
  say(7, EventKind::zone_entered, "a");
  EXPECT_EQ(outcome(1), TaskOutcome::done);
}

TEST_F(GraderTest, FollowingIsBeingNearForLongEnoughOnEnd) {
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

TEST_F(GraderTest, BeingTooNearIsChargedOnceForEachTime) {
  training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
  training_.penalties = {penalty("too near", 3, of(Kind::near, "person_1", 1))};
  start();
  for (int i = 0; i < 5; ++i) stand(0.1 * i, 0, 0, 0, {{"person_1", {0.5, 0}}});
  EXPECT_EQ(grader_->grade().charges.size(), 1U);
  stand(1, 0, 0, 0, {{"person_1", {3, 0}}});
  stand(2, 0, 0, 0, {{"person_1", {0.5, 0}}});
  EXPECT_EQ(grader_->grade().charges.size(), 2U);
}

TEST_F(GraderTest, HoldingStillStartsAnewWithEachMovement) {
  training_.tasks = {task("hold still", 10, of(Kind::still, "", 0, 5))};
  start();
  say(0, EventKind::movement_started);
  say(2, EventKind::movement_stopped);
  say(6, EventKind::movement_started);
  say(7, EventKind::movement_stopped);
  stand(11.9, 0);
  EXPECT_EQ(outcome(), TaskOutcome::open);
  stand(12, 0);
  EXPECT_EQ(outcome(), TaskOutcome::done);
}

TEST_F(GraderTest, InspectingNeedsItInThePictureNearEnoughAndNotHidden) {
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
  say(1, EventKind::zone_entered, "a");
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

TEST_F(GraderTest, WhoIsInTheZoneAlreadyHasReachedIt) {
  training_.tasks = {task("first", 10, on(EventKind::gripped)),
                     task("be in the hall", 10, of(Kind::reach, "hall"))};
  start();
  say(1, EventKind::zone_entered, "hall");
  say(2, EventKind::gripped, "crate");
  stand(2.1, 0);
  EXPECT_EQ(outcome(1), TaskOutcome::done);
}

}  // namespace
}  // namespace parhelion
