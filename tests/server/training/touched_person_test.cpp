// Driving into a real person: the worst mark there is.
#include <gtest/gtest.h>

#include "grader_fixture.hpp"

namespace parhelion::training {
namespace {

using test::on;
using test::task;

class TouchedPerson : public test::GraderTest {
 protected:
  void SetUp() override {
    training_.tasks = {task("first", 40, on(EventKind::zone_entered, "hall")),
                       task("second", 60, on(EventKind::zone_entered, "yard"))};
  }
  void do_everything(double t) {
    add_event(t, EventKind::zone_entered, "hall");
    add_event(t + 1, EventKind::zone_entered, "yard");
  }
  void touch(double t, const std::string& who = "rover") {
    add_event(t, EventKind::person_touched, "real person 3", 12, 0, who);
  }
  void drives(double t, const std::string& name, const std::string& robot) {
    add_event(t, EventKind::operator_switched, robot, 0, 0, name);
  }
  void world_of(const std::string& robots) {
    WorldMessage world;
    world.stamp = {test::at(0).ns};
    world.robot = robots;
    grader_->take(world);
  }
};

TEST_F(TouchedPerson, fails_the_session_by_default_even_where_any_score_passes) {
  start();
  touch(1);
  do_everything(2);
  const Grade grade = grader_->grade();
  EXPECT_EQ(grade.awarded, 100);
  EXPECT_EQ(grade.score, 0);
  EXPECT_FALSE(grade.passed);
  ASSERT_EQ(grade.deductions.size(), 1U);
  EXPECT_EQ(grade.deductions[0].rule, kPersonTouched);
  EXPECT_EQ(grade.deductions[0].points, 100);
  ASSERT_TRUE(grade.deductions[0].cause);
  EXPECT_EQ(grade.deductions[0].cause->object, "real person 3");
}

TEST_F(TouchedPerson, without_it_the_same_session_is_passed) {
  start();
  do_everything(2);
  EXPECT_TRUE(grader_->grade().passed);
  EXPECT_EQ(grader_->grade().score, 100);
}

TEST_F(TouchedPerson, counts_once) {
  start();
  touch(1);
  touch(2);
  EXPECT_EQ(grader_->grade().deductions.size(), 1U);
}

TEST_F(TouchedPerson, is_shown_when_it_happens) {
  start();
  grader_->take_events();
  touch(1);
  bool deducted = false;
  for (const Event& event : grader_->take_events())
    deducted = deducted || (event.kind == EventKind::points_deducted && event.object == kPersonTouched);
  EXPECT_TRUE(deducted);
}

TEST_F(TouchedPerson, may_be_left_to_the_penalties) {
  training_.person_contact_fails = false;
  training_.penalties = {test::penalty("a person", 30, on(EventKind::person_touched))};
  start();
  touch(1);
  do_everything(2);
  EXPECT_EQ(grader_->grade().score, 70);
  EXPECT_TRUE(grader_->grade().passed);
}

TEST_F(TouchedPerson, after_the_end_of_the_time_changes_nothing) {
  training_.limit = 5;
  start();
  do_everything(1);
  touch(6);
  EXPECT_TRUE(grader_->grade().passed);
}

TEST_F(TouchedPerson, by_a_virtual_robot_counts_if_the_trainee_drives_it) {
  start();
  touch(1, "helper");
  EXPECT_TRUE(grader_->grade().deductions.empty()) << "nobody drives it";
  drives(2, "ann", "rover");
  drives(3, "ann", "helper");
  touch(4, "helper");
  EXPECT_FALSE(grader_->grade().passed);
  EXPECT_EQ(grader_->grade().deductions.size(), 1U);
}

TEST_F(TouchedPerson, by_another_trainees_robot_is_that_trainees) {
  start();
  world_of("rover rover_2");
  drives(1, "ben", "rover_2");
  touch(2, "rover_2");
  drives(3, "ben", "helper");
  touch(4, "helper");
  EXPECT_TRUE(grader_->grade().deductions.empty());
  drives(5, "ann", "rover");
  drives(6, "ann", "helper");
  touch(7, "helper");
  EXPECT_EQ(grader_->grade().deductions.size(), 1U);
}

/// Their names do not hide whose robot somebody drove last.
TEST_F(TouchedPerson, by_another_trainee_is_that_trainees_after_a_thousand_consoles_were_lost) {
  start();
  world_of("rover rover_2");
  for (int i = 0; i < 1500; ++i) {
    const std::string name = "operator_" + std::to_string(i);
    drives(1, name, "rover");
    add_event(1, EventKind::console_lost, "rover", 0, 0, name);
  }
  drives(2, "ben", "rover_2");
  drives(3, "ben", "helper");
  touch(4, "helper");
  EXPECT_TRUE(grader_->grade().deductions.empty());
}

/// Names come from the bus.
TEST_F(TouchedPerson, is_known_of_a_thousand_operators) {
  start();
  drives(1, "ann", "rover");
  for (int i = 0; i < 2000; ++i) drives(1.5, "operator_" + std::to_string(i), "rover");
  drives(2, "somebody new", "helper");
  touch(3, "helper");
  EXPECT_TRUE(grader_->grade().deductions.empty());
  drives(4, "ann", "helper");
  touch(5, "helper");
  EXPECT_EQ(grader_->grade().deductions.size(), 1U) << "of those who drove before";
}

}  // namespace
}  // namespace parhelion::training
