// Graded reports and actions of trainees, simulated faults, and unreachable zones.
#include "server/tick/grading_path.hpp"

#include <gmock/gmock.h>

#include <array>
#include <cmath>

#include "server/tick/check_reach.hpp"
#include "server/tick/check_training.hpp"
#include "tests/server/tick/level_1.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using test::level_1;
using testing::HasSubstr;

std::int64_t us(double t) { return test::kStartUs + static_cast<std::int64_t>(t * 1e6); }

Fault fault(Fault::Kind kind, double amount, double after = 0) {
  Fault made;
  made.kind = kind;
  made.amount = amount;
  made.after = after;
  return made;
}

class GradingPath : public test::TickTest {
 protected:
  void drive(double until, double vx, double wz = 0) {
    for (; time_ < until - 1e-9; time_ += 0.05)
      feed(test::message(channel::kTeleop, us(time_),
                         TwistCommand{SensorTime::from_utime(us(time_)), {vx, 0, wz}}));
  }
  void wait(double until) {
    time_ = until;
    advance_to(ArrivalTime::from_utime(us(until)));
  }
  void report(const std::string& object, std::optional<Eigen::Vector2d> position = {}) {
    const SensorTime stamp = SensorTime::from_utime(us(time_ += 0.01));
    feed(test::message(channel::kMrObjectReport, us(time_), ObjectReport{stamp, 7, object, position}));
  }
  std::vector<Event> events(EventKind kind) {
    std::vector<Event> all = decoded<Event>(channel::kMrEvents);
    std::erase_if(all, [kind](const Event& event) { return event.kind != kind; });
    return all;
  }
  double time_ = 0;
};

TEST_F(GradingPath, AReportIsPublishedWithPositionErrorAndReply) {
  start(level_1({test::agent("gauge", AgentKind::box, 1, 1)}));
  report("gauge");
  report("gauge", Eigen::Vector2d(1.3, 1.4));
  report("unicorn", Eigen::Vector2d(0, 0));
  const auto reports = events(EventKind::object_reported);
  ASSERT_EQ(reports.size(), 3U);
  EXPECT_EQ(reports[0].subject, "trainee");
  EXPECT_EQ(reports[0].object, "gauge");
  EXPECT_EQ(reports[0].value, -1);
  EXPECT_NEAR(reports[1].value, 0.5, 1e-6);
  EXPECT_EQ(reports[1].position.x(), 1.3);
  EXPECT_EQ(reports[2].value, -1) << "there is no such thing";
  EXPECT_EQ(events(EventKind::command_accepted).size(), 3U);
}

TEST_F(GradingPath, DeadManFollowsTeleopMessagesAndTheirTimeout) {
  start(level_1());
  drive(0.3, 0);
  EXPECT_TRUE(events(EventKind::dead_man_pressed).empty()) << "a stop is no beginning";
  drive(1, 0.4);
  EXPECT_EQ(events(EventKind::dead_man_pressed).size(), 1U);
  EXPECT_TRUE(events(EventKind::dead_man_released).empty());
  wait(2);
  ASSERT_EQ(events(EventKind::dead_man_released).size(), 1U);
  EXPECT_NEAR(events(EventKind::dead_man_released)[0].value, 0.4, 1e-6) << "let go in motion";
  drive(3, 0.4);
  drive(5, 0);
  wait(6);
  EXPECT_EQ(events(EventKind::dead_man_pressed).size(), 2U);
  ASSERT_EQ(events(EventKind::dead_man_released).size(), 2U);
  EXPECT_EQ(events(EventKind::dead_man_released)[1].value, 0) << "it stood";
}

TEST_F(GradingPath, DropoutsRemoveTheirFractionOfBeamsWhileTheyLast) {
  Scenario scenario;
  scenario.faults = {fault(Fault::Kind::laser_dropouts, 0.25, 1)};
  scenario.faults[0].lasting = 1;
  start(level_1({test::agent("box_1", AgentKind::box, 0, 0)}, scenario));
  wait(3);
  const LaserDescription& laser = *configuration_.robot.laser;
  const auto scans = decoded<Scan>(channel::kMrScan);
  const auto infos = decoded<ScanInfo>(channel::kMrScanInfo);
  ASSERT_EQ(scans.size(), infos.size());
  // Before, during, after: the room's corners have gaps.
  std::array<double, 3> beams{}, nothing{};
  for (std::size_t k = 0; k < scans.size(); ++k) {
    const double age = static_cast<double>(scans[k].stamp.utime() - us(-0.002)) * 1e-6;
    if (std::abs(age - 1) < 0.01 || std::abs(age - 2) < 0.01) continue;
    const std::size_t phase = age < 1 ? 0 : age < 2 ? 1 : 2;
    for (std::size_t i = 0; i < scans[k].ranges.size(); ++i) {
      beams[phase] += 1;
      if (laser.convention.classify(scans[k].ranges[i]) != BeamKind::no_return) continue;
      nothing[phase] += 1;
      EXPECT_EQ(infos[k].beam_agent[i], -1);
    }
  }
  const double always = nothing[0] / beams[0];
  EXPECT_LT(always, 0.05);
  EXPECT_NEAR(nothing[2] / beams[2], always, 0.01) << "the same few beams see the corners or do not";
  const double expected = always + 0.25 * (1 - always);
  EXPECT_NEAR(nothing[1] / beams[1], expected, 4 * std::sqrt(0.25 / beams[1]) + 0.01);
  ASSERT_EQ(events(EventKind::fault_started).size(), 1U);
  EXPECT_EQ(events(EventKind::fault_started)[0].object, "laser_dropouts");
  EXPECT_EQ(events(EventKind::fault_ended).size(), 1U);
}

TEST_F(GradingPath, ADeadWheelTurnsTheRobotButNotTheCommand) {
  for (const bool right : {false, true}) {
    Scenario scenario;
    scenario.faults = {fault(Fault::Kind::dead_wheel, 0)};
    scenario.faults[0].right = right;
    out_.clear();
    time_ = 0;
    start(level_1({}, scenario));
    drive(2, 0.5);
    const double yaw = state_->simulation.robot_motion("trainee")->T_map_base.yaw();
    EXPECT_GT(right ? -yaw : yaw, 0.3) << (right ? "right" : "left");
    const auto commands = decoded<TwistCommand>(channel::kMrCmd);
    ASSERT_GT(commands.size(), 30U);
    EXPECT_EQ(commands.front().twist.vx, 0) << "its pose is not known yet";
    for (std::size_t i = 1; i < commands.size(); ++i) EXPECT_EQ(commands[i].twist.vx, 0.5) << i;
    for (const auto& command : commands) EXPECT_EQ(command.twist.wz, 0);
    EXPECT_EQ(events(EventKind::fault_started)[0].text, right ? "right" : "left");
  }
}

TEST_F(GradingPath, WithBothSidesDeadTheRobotStops) {
  Scenario scenario;
  scenario.faults = {fault(Fault::Kind::dead_wheel, 0), fault(Fault::Kind::dead_wheel, 0)};
  scenario.faults[1].right = true;
  start(level_1({}, scenario));
  const Eigen::Vector3d before = state_->simulation.robot_motion("trainee")->T_map_base.translation();
  drive(2, 0.5);
  const Eigen::Vector3d after = state_->simulation.robot_motion("trainee")->T_map_base.translation();
  EXPECT_LT((after - before).head<2>().norm(), 0.01);
}

TEST_F(GradingPath, ALowBatteryStartsWithTheGivenCharge) {
  Scenario scenario;
  scenario.faults = {fault(Fault::Kind::low_battery, 0.15)};
  start(level_1({}, scenario));
  wait(1);
  EXPECT_NEAR(*state_->tally.battery_left, 0.15, 0.001);
  ASSERT_EQ(events(EventKind::battery_low).size(), 1U);
}

/// A room from -4 to 4 in x and y, the robot at (-2, 0).
class ReachTest : public testing::Test {
 protected:
  std::string error_of(double x, double y, double side, bool walled_off = false) {
    Scenario scenario;
    Zone zone;
    zone.name = "goal";
    zone.outline = {{x - side, y - side}, {x + side, y - side}, {x + side, y + side}, {x - side, y + side}};
    scenario.zones = {zone};
    Task task;
    task.name = "go";
    task.points = 1;
    task.done.kind = Condition::Kind::reach;
    task.done.target = "goal";
    scenario.training.emplace().tasks = {task};
    SemanticModel model = test::room();
    if (walled_off) model.entities.push_back(test::wall("fence", 1, 0, std::numbers::pi / 2, 12));
    const Status reached = check_reach(level_1({}, scenario, model));
    return reached ? "" : reached.error().message;
  }
};

TEST_F(ReachTest, OnlyZonesInsideTheRoomAreReachable) {
  EXPECT_EQ(error_of(2, 0, 0.3), "");
  EXPECT_EQ(error_of(2, 0, 0.01), "") << "smaller than a cell of the search";
  EXPECT_THAT(error_of(2, 0, 0.3, true),
              HasSubstr("task 'go': zone 'goal' cannot be reached: no route leads to it"));
  EXPECT_THAT(error_of(1, 0, 0.04, true), HasSubstr("the robot does not fit into it; it lies in 'fence'"));
}

/// The error of a training of one task with this condition; there is a person called guide.
std::string training_error(Condition condition) {
  Scenario scenario;
  Task task;
  task.name = "t";
  task.done = std::move(condition);
  scenario.training.emplace().tasks = {task};
  const Status known = check_training(level_1({test::agent("guide", AgentKind::person, 1, 1)}, scenario));
  return known ? "" : known.error().message;
}

TEST(CheckTraining, NamesInConditionsMustExist) {
  Condition condition;
  condition.kind = Condition::Kind::follow;
  condition.target = "guide";
  EXPECT_EQ(training_error(condition), "");
  condition.target = "giude";
  EXPECT_THAT(training_error(condition),
              HasSubstr("task 't': there is no agent 'giude', did you mean 'guide'?"));
  condition.kind = Condition::Kind::report;
  EXPECT_THAT(training_error(condition), HasSubstr("did you mean 'guide'?"));
  condition.kind = Condition::Kind::place;
  condition.target = "guide";
  condition.into = "gide";
  EXPECT_THAT(training_error(condition), HasSubstr("there is no container 'gide', did you mean 'guide'?"));
  condition = {};
  condition.object = "guied";
  EXPECT_THAT(training_error(condition), HasSubstr("contact_started of 'guied' can never occur"));
  condition.event = EventKind::near_miss;
  EXPECT_THAT(training_error(condition), HasSubstr("near_miss of 'guied' can never occur"));
}

TEST(CheckTraining, ANearMissLimitMustSpecifyDistanceOrTime) {
  Condition condition;
  condition.event = EventKind::near_miss;
  condition.object = "guide";
  EXPECT_EQ(training_error(condition), "");
  condition.max = 0.1;
  EXPECT_THAT(training_error(condition), HasSubstr("add 'text: gap' or 'text: time' beside the limit"));
  condition.text = "gap";
  EXPECT_EQ(training_error(condition), "");
  condition.text = "distance";
  EXPECT_THAT(training_error(condition), HasSubstr("not 'distance'"));
}

}  // namespace
}  // namespace parhelion::tick
