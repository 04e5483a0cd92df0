// All kinds of penalties: each kind of event, distinguished by its text and its value.
#include "server/training/grading_text.hpp"
#include "tests/server/training/grader_fixture.hpp"

namespace parhelion::training {
namespace {

using test::at, test::of, test::on, test::penalty, test::task;
using Kind = Condition::Kind;

class PenaltyKinds : public test::GraderTest {
 protected:
  std::size_t deductions() const { return grader_->grade().deductions.size(); }
};

TEST_F(PenaltyKinds, AConditionCanSelectAnEventByItsText) {
  training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
  Condition held = on(EventKind::speed_limited);
  held.text = "contact";
  training_.penalties = {penalty("held back", 3, held)};
  start();
  Event event;
  event.kind = EventKind::speed_limited;
  event.subject = "rover";
  for (const char* why : {"silence", "contact"}) {
    event.stamp = at(why == std::string("contact") ? 2 : 1);
    event.text = why;
    grader_->take(event);
  }
  ASSERT_EQ(deductions(), 1U);
  EXPECT_EQ(grader_->grade().deductions[0].at, at(2));
}

TEST_F(PenaltyKinds, ANearMissIsPenalizedByDistanceAndTime) {
  training_.tasks = {task("t", 100, of(Kind::reach, "hall"))};
  const auto miss = [](const char* by, double max) {
    Condition condition = on(EventKind::near_miss);
    condition.text = by;
    condition.max = max;
    return condition;
  };
  training_.penalties = {penalty("shave", 1, miss("gap", 0.2)), penalty("scrape", 10, miss("gap", 0.05)),
                         penalty("late", 2, miss("time", 1)), penalty("too late", 20, miss("time", 0.5))};
  start();
  const auto passes = [&](double t, const char* by, double value) {
    Event event;
    event.stamp = at(t);
    event.kind = EventKind::near_miss;
    event.subject = "rover";
    event.object = "person_1";
    event.text = by;
    event.value = value;
    grader_->take(event);
    return grader_->grade().deducted;
  };
  EXPECT_EQ(passes(1, "gap", 0.12), 1);
  EXPECT_EQ(passes(2, "gap", 0.05), 12);
  EXPECT_EQ(passes(3, "time", 0.9), 14) << "0.9 s is no gap of 0.9 m, nor a late turn";
  EXPECT_EQ(passes(4, "time", 0.4), 36);
  EXPECT_EQ(event_text(grader_->grade().deductions.back().cause),
            "near_miss rover - person_1 (0.40 s to a collision)");
  EXPECT_EQ(event_text(grader_->grade().deductions.front().cause), "near_miss rover - person_1 (0.12 m)");
}

/// Each as an event of its own kind, as published by the server.
TEST_F(PenaltyKinds, EveryRequiredPenaltyIsExpressible) {
  const EventKind kinds[] = {
      EventKind::collision_predicted, EventKind::near_miss,      EventKind::pitch_limit,
      EventKind::roll_warning,        EventKind::yaw_rate_limit, EventKind::fell,
      EventKind::tipped_over,         EventKind::joint_broken,   EventKind::joint_overload,
      EventKind::door_unhinged,       EventKind::zone_entered,   EventKind::speed_limited,
      EventKind::dead_man_released,   EventKind::contact_started};
  for (const EventKind kind : kinds) {
    training_.tasks = {task("t", 10, of(Kind::reach, "hall"))};
    training_.penalties = {penalty("p", 3, on(kind))};
    start();
    add_event(1, kind, "thing");
    EXPECT_EQ(deductions(), 1U) << to_string(kind);
    start();
    Event undetectable;
    undetectable.stamp = at(1);
    undetectable.kind = kind;
    undetectable.subject = "rover";
    undetectable.undetectable = true;
    grader_->take(undetectable);
    EXPECT_EQ(deductions(), 0U) << to_string(kind) << " that could not be seen coming";
  }
  training_.penalties = {penalty("hazard", 3, on(EventKind::hazard_triggered))};
  start();
  add_event(1, EventKind::hazard_triggered, "other_robot", 0, 0, "mine");
  EXPECT_EQ(deductions(), 0U);
  add_event(2, EventKind::hazard_triggered, "rover", 0, 0, "mine");
  EXPECT_EQ(deductions(), 1U) << "the event's subject is the device, its object the approaching body";
}

}  // namespace
}  // namespace parhelion::training
