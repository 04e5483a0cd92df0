// Each robot of a session is graded by what it did itself.
#include <gtest/gtest.h>

#include "tests/server/tick/several_robots.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using namespace test;

/// Ten points beside the barrel in rover_2's corner, one off for each press of the dead-man switch.
Training beside_the_barrel() {
  Training training;
  training.on_command = false;
  training.pass_mark = 0.5;
  Task task;
  task.name = "at the barrel", task.points = 10;
  task.done.kind = Condition::Kind::near;
  task.done.target = "barrel_1", task.done.distance = 1.2, task.done.duration = 0.5;
  training.tasks = {task};
  Penalty pressed;
  pressed.name = "pressed", pressed.points = 1;
  pressed.when.event = EventKind::dead_man_pressed;
  training.penalties = {pressed};
  return training;
}

class SeveralRobotsGradingTest : public TickTest {
 protected:
  /// rover_1 drives its circle, rover_2 stands beside the barrel; one of them is driven by commands.
  void run(const std::string& driven, Training training = beside_the_barrel()) {
    Scenario scenario = two_robots({agent("barrel_1", AgentKind::barrel, 3.2, -2.4)});
    scenario.training = std::move(training);
    start(two_robots_configuration(scenario));
    feed(two_robots_drive(2));
    feed(message(robot_channel(channel::kTeleop, driven), kStartUs + 2'000'000,
                 TwistCommand{SensorTime::from_utime(kStartUs + 2'000'000), {0.1, 0, 0}}));
    advance_to(ArrivalTime::from_utime(kStartUs + 2'100'000));
  }
  training::Grade grade(std::size_t robot) { return state_->grading->graders.at(robot).grade(); }
};

TEST_F(SeveralRobotsGradingTest, EachRobotsTasksAreItsOwn) {
  run(kRover2);
  ASSERT_EQ(state_->grading->graders.size(), 2U);
  EXPECT_EQ(grade(0).awarded, 0) << "it only drove past";
  EXPECT_FALSE(grade(0).passed);
  EXPECT_EQ(grade(1).awarded, 10);
  EXPECT_TRUE(grade(1).passed);
}

TEST_F(SeveralRobotsGradingTest, EachRobotPaysForItsOwnFaults) {
  run(kRover1);
  EXPECT_EQ(grade(0).deducted, 1);
  EXPECT_EQ(grade(1).deducted, 0);
  EXPECT_EQ(grade(1).score, 10);
}

TEST_F(SeveralRobotsGradingTest, ATrainingOfOneRobotGradesThatOne) {
  Training training = beside_the_barrel();
  training.robot = kRover2;
  run(kRover2, training);
  ASSERT_EQ(state_->grading->graders.size(), 1U);
  EXPECT_EQ(grade(0).score, 10);
}

}  // namespace
}  // namespace parhelion::tick
