// Finding, following, keeping away, handling, leaning: what each condition counts, and what it does not.
#include "tests/server/training/grader_fixture.hpp"

namespace parhelion::training {
namespace {

using test::at, test::join, test::never, test::of, test::on, test::penalty, test::task, test::within;
using Kind = Condition::Kind;

Condition amount(Kind kind, double threshold, double duration = 0) {
  Condition condition = of(kind, "", 0, duration);
  condition.amount = threshold;
  return condition;
}

class ConditionKinds : public test::GraderTest {
 protected:
  void report(double t, const std::string& what, double off) {
    Event event;
    event.stamp = at(t);
    event.kind = EventKind::object_reported;
    event.subject = "rover";
    event.object = what;
    event.value = off;
    grader_->take(event);
  }
  void place(double t, const std::string& what, const std::string& into) {
    Event event;
    event.stamp = at(t);
    event.kind = EventKind::placed;
    event.subject = "rover";
    event.object = into;
    event.text = what;
    grader_->take(event);
  }
  void lean(double t, double pitch, double roll, double yaw_rate = 0, double speed = 0) {
    WorldMessage world;
    world.stamp = {at(t).ns};
    WorldMessage::Entry& rover = world.bodies.emplace_back();
    rover.entity = "rover";
    rover.T_map_body =
        Transform<Map, Body>(Eigen::Quaterniond(Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                                Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX())),
                             {0, 0, 0});
    rover.velocity = {speed, 0, 0};
    rover.rotation_rate = rover.T_map_body.rotation() * Eigen::Vector3d(0, 0, yaw_rate);
    grader_->take(world);
  }
};

TEST_F(ConditionKinds, AReportCountsForItsNamedObjectAndPlace) {
  training_.in_order = false;
  training_.tasks = {task("found", 10, of(Kind::report, "gauge")),
                     task("and where", 10, of(Kind::report, "gauge", 1))};
  start();
  report(1, "valve", 0.1);
  EXPECT_EQ(outcome(0), TaskOutcome::open) << "something else";
  report(2, "gauge", -1);
  EXPECT_EQ(outcome(0), TaskOutcome::done);
  EXPECT_EQ(outcome(1), TaskOutcome::open) << "no position was reported";
  report(3, "gauge", 1.01);
  EXPECT_EQ(outcome(1), TaskOutcome::open) << "too far off";
  report(4, "gauge", 1);
  EXPECT_EQ(outcome(1), TaskOutcome::done);
  EXPECT_EQ(grader_->grade().tasks[1].cause->value, 1);
}

TEST_F(ConditionKinds, AWrongReportCanBePenalized) {
  training_.tasks = {task("found", 10, of(Kind::report, "gauge"))};
  training_.penalties = {penalty("wrong", 3, on(EventKind::object_reported, "valve"))};
  start();
  report(1, "valve", -1);
  report(2, "gauge", -1);
  EXPECT_EQ(grader_->grade().score, 7);
}

TEST_F(ConditionKinds, FollowingRequiresContinuousNearness) {
  training_.tasks = {task("follow", 10, of(Kind::follow, "guide", 2, 3))};
  start();
  stand(0, 0, 0, 0, {{"guide", {1, 0}}});
  stand(2, 0, 0, 0, {{"guide", {2.5, 0}}});
  stand(2.5, 1, 0, 0, {{"guide", {2.5, 0}}});
  stand(5.4, 1, 0, 0, {{"guide", {2.5, 0}}});
  EXPECT_EQ(outcome(), TaskOutcome::open) << "it was lost at 2 s";
  stand(5.5, 1, 0, 0, {{"guide", {2.5, 0}}});
  EXPECT_EQ(outcome(), TaskOutcome::done);
}

TEST_F(ConditionKinds, AvoidingFailsOnNearnessAndSucceedsAfterItsTime) {
  training_.in_order = false;
  training_.tasks = {task("far", 10, of(Kind::avoid, "robot_2", 1, 10)),
                     task("untouched", 10, of(Kind::avoid, "robot_2", 0, 10))};
  start();
  stand(1, 0, 0, 0, {{"robot_2", {1.1, 0}}});
  stand(2, 0, 0, 0, {{"robot_2", {0.9, 0}}});
  EXPECT_EQ(outcome(0), TaskOutcome::failed);
  stand(9.9, 0, 0, 0, {{"robot_2", {0.9, 0}}});
  EXPECT_EQ(outcome(1), TaskOutcome::open);
  stand(10, 0, 0, 0, {{"robot_2", {0.9, 0}}});
  EXPECT_EQ(outcome(1), TaskOutcome::done);
  start();
  add_event(3, EventKind::contact_started, "wall 1");
  EXPECT_EQ(outcome(1), TaskOutcome::open);
  add_event(4, EventKind::contact_started, "rover", 1, 0, "robot_2");
  EXPECT_EQ(outcome(1), TaskOutcome::failed);
  EXPECT_EQ(grader_->grade().tasks[1].cause->subject, "robot_2");
  start();
  add_event(3, EventKind::contact_continues, "robot_2");
  EXPECT_EQ(outcome(1), TaskOutcome::failed) << "it touched already when this began";
}

TEST_F(ConditionKinds, HandlingRequiresTheNamedObjectAndContainer) {
  Condition into = of(Kind::place, "cube");
  into.into = "box";
  training_.tasks = {
      task("put away", 10, join(Kind::then, {of(Kind::grip, "cube"), of(Kind::lift, "cube"), into}))};
  start();
  add_event(1, EventKind::gripped, "pipe");
  add_event(2, EventKind::lifted, "cube");
  add_event(3, EventKind::gripped, "cube", 0, 0, "other_robot");
  place(4, "cube", "box");
  EXPECT_EQ(outcome(), TaskOutcome::open) << "it was not gripped by ours";
  add_event(5, EventKind::gripped, "cube");
  add_event(6, EventKind::lifted, "cube");
  place(7, "cube", "tub");
  place(8, "pipe", "box");
  EXPECT_EQ(outcome(), TaskOutcome::open);
  place(9, "cube", "box");
  EXPECT_EQ(outcome(), TaskOutcome::done);
}

TEST_F(ConditionKinds, TiltAndSpeedArePenalizedAtEachExceedance) {
  training_.tasks = {task("t", 100, of(Kind::reach, "hall"))};
  training_.penalties = {
      penalty("pitch", 1, amount(Kind::pitch, 0.3)), penalty("roll", 10, amount(Kind::roll, 0.2)),
      penalty("spin", 100, amount(Kind::yaw_rate, 1)), penalty("fast", 1000, amount(Kind::speed, 0.8, 1))};
  start();
  lean(0, 0, 0);
  lean(1, -0.31, 0.1);
  lean(2, -0.35, 0.1);
  EXPECT_EQ(grader_->grade().deducted, 1) << "once for each time";
  lean(3, 0, -0.2001);
  EXPECT_EQ(grader_->grade().deducted, 11);
  lean(4, 0.31, 0, -1.01);
  EXPECT_EQ(grader_->grade().deducted, 112);
  lean(5, 0, 0, 0, 0.9);
  lean(5.9, 0, 0, 0, 0.9);
  EXPECT_EQ(grader_->grade().deducted, 112) << "not for long enough";
  lean(6, 0, 0, 0, 0.9);
  EXPECT_EQ(grader_->grade().deducted, 1112);
}

TEST_F(ConditionKinds, HiddenVirtualAgentsAreNotNear) {
  training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
  training_.penalties = {penalty("person", 3, of(Kind::near, "person_1", 1)),
                         penalty("wall", 2, of(Kind::near, "wall 1", 1))};
  start();
  add_event(0, EventKind::injection_suspended);
  stand(1, 0, 2.5, 0, {{"person_1", {0.5, 2.5}}});
  EXPECT_EQ(grader_->grade().deducted, 2) << "the wall is real";
  add_event(2, EventKind::injection_active);
  stand(2.1, 0, 2.5, 0, {{"person_1", {0.5, 2.5}}});
  EXPECT_EQ(grader_->grade().deducted, 5);
}

TEST_F(ConditionKinds, OnlyTheHiddenAgentIsNotNear) {
  training_.tasks = {task("t", 10, of(Kind::avoid, "person_1", 1, 5))};
  training_.penalties = {penalty("person 1", 3, of(Kind::near, "person_1", 1)),
                         penalty("person 2", 2, of(Kind::near, "person_2", 1))};
  start();
  add_event(0, EventKind::agent_hidden, "person_1");
  stand(1, 0, 2.5, 0, {{"person_1", {0.5, 2.5}}, {"person_2", {-0.5, 2.5}}});
  EXPECT_EQ(grader_->grade().deducted, 2);
  EXPECT_EQ(outcome(), TaskOutcome::open) << "it could not be avoided either";
  add_event(2, EventKind::agent_shown, "person_1");
  stand(2.1, 0, 2.5, 0, {{"person_1", {0.5, 2.5}}, {"person_2", {-0.5, 2.5}}});
  EXPECT_EQ(grader_->grade().deducted, 5);
  EXPECT_EQ(outcome(), TaskOutcome::failed);
}

TEST_F(ConditionKinds, ReportsScoreChangesAndDoesNotGradeThem) {
  training_.tasks = {task("in", 50, of(Kind::reach, "hall")), task("up", 50, of(Kind::climb, "stairs 1"))};
  training_.tasks[1].limit = 5;
  training_.penalties = {penalty("bump", 7, on(EventKind::contact_started))};
  Condition any = on(EventKind::score_changed);
  any.subject = "any";
  training_.penalties.push_back(penalty("feedback", 1, any));
  start();
  std::vector<Event> events = grader_->take_events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].kind, EventKind::task_started);
  EXPECT_EQ(events[0].object, "in");
  EXPECT_EQ(events[0].value, 50);
  add_event(1, EventKind::contact_started, "wall 1", 2);
  events = grader_->take_events();
  ASSERT_EQ(events.size(), 1U) << "a score of 0 stays";
  EXPECT_EQ(events[0].kind, EventKind::points_deducted);
  EXPECT_EQ(events[0].object, "bump");
  EXPECT_EQ(events[0].value, 7);
  EXPECT_EQ(events[0].text, "contact_started rover - wall 1, 2.00 N s");
  add_event(2, EventKind::zone_entered, "hall");
  events = grader_->take_events();
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].kind, EventKind::task_done);
  EXPECT_EQ(events[1].kind, EventKind::score_changed);
  EXPECT_EQ(events[1].value, 43);
  EXPECT_EQ(events[1].text, "+50 points");
  EXPECT_EQ(events[2].object, "up");
  grader_->take(events[1]);
  EXPECT_TRUE(grader_->take_events().empty());
  stand(7.1, 0);
  events = grader_->take_events();
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].kind, EventKind::task_failed);
  EXPECT_EQ(events[0].text, "out of time");
  EXPECT_EQ(events[1].kind, EventKind::grading_ended);
  EXPECT_EQ(events[1].value, 43);
  EXPECT_EQ(events[1].text, "43 of 100 points (43.0 %), passed");
  grader_->close(at(8));
  EXPECT_TRUE(grader_->take_events().empty()) << "reported once";
}

}  // namespace
}  // namespace parhelion::training
