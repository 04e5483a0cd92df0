// What ends a drive of a simulated robot: radio range, an empty battery, a lost console; and the readings of
// its hazard sensor.
#include <gmock/gmock.h>

#include "server/runtime/report.hpp"
#include "tests/server/tick/levels_fixture.hpp"

namespace parhelion::runtime {
namespace {

using test::hazardous;
using test::level_1;
using test::LevelsTest;
using test::teleop_at;
using testing::HasSubstr;

TEST_F(LevelsTest, OutOfRadioRangeTheRobotStops) {
  Scenario scenario = hazardous();
  scenario.battery.reset();
  start(level_1({}, scenario));
  run(6, Twist2{0.4, 0, 0});
  const auto lost = events(EventKind::radio_lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(lost[0].subject, "trainee");
  EXPECT_NEAR(lost[0].position.x(), -0.5, 0.05);
  EXPECT_EQ(events(EventKind::hazard_triggered).size(), 1U) << "it rolls on for its half second";
  EXPECT_EQ(decoded<TwistCommand>(channel::kMrCmd).back().twist.vx, 0);
  EXPECT_THAT(events(EventKind::speed_limited).back().text, HasSubstr("silen"));
  EXPECT_LT(motion().velocity.norm(), 0.01);
  EXPECT_NEAR(motion().T_map_base.translation().x(), -0.5 + 0.4 * 0.5, 0.15);
  EXPECT_EQ(state_->tally.refused_inputs, 0U) << state_->tally.last_refusal;
  Report report;
  report.tally = state_->tally;
  const ServerStatus status = to_status(report, {});
  const auto radio = std::find_if(status.values.begin(), status.values.end(),
                                  [](const auto& value) { return value.first == "radio_dbm"; });
  ASSERT_NE(radio, status.values.end());
  EXPECT_LT(radio->second, scenario.radio->sensitivity);
  EXPECT_FALSE(state_->tally.battery_left);
}

TEST_F(LevelsTest, HazardSensorReportsAtTenHertz) {
  start(level_1({}, hazardous()));
  run(2);
  const auto readings = decoded<HazardReading>(channel::kHazard);
  EXPECT_NEAR(static_cast<double>(readings.size()), 20, 1);
  ASSERT_EQ(readings.back().values.size(), 2U) << "rate and dose";
  const double height = configuration_.robot.height;
  const Eigen::Vector3d sensor = motion().T_map_base * Eigen::Vector3d(0, 0, height);
  const double truth = 100 / (Eigen::Vector3d(1, 0, 0.5) - sensor).squaredNorm();
  const HazardSensor& its = configuration_.scenario.hazard_sensor;
  EXPECT_NEAR(readings.back().values[0].value, truth,
              4 * truth / std::sqrt(2 * its.radiation_counts * truth * its.radiation_lag));
  EXPECT_NE(readings.back().values[0].value, readings[readings.size() - 2].values[0].value) << "it counts";
  EXPECT_EQ(readings.back().values[0].unit, "uSv/h");
  EXPECT_NEAR((readings.back().stamp - readings.front().stamp).seconds(), 0.1 * (readings.size() - 1.0),
              1e-5);
}

TEST_F(LevelsTest, DosesAccumulateAndTheirLimitsAreEvents) {
  Scenario scenario = hazardous();
  scenario.dose_limits.radiation = {0.005, 0.01};
  start(level_1({}, scenario));
  run(5);
  const auto readings = decoded<HazardReading>(channel::kHazard);
  const double height = configuration_.robot.height;
  const Eigen::Vector3d sensor = motion().T_map_base * Eigen::Vector3d(0, 0, height);
  const double rate = 100 / (Eigen::Vector3d(1, 0, 0.5) - sensor).squaredNorm();  // uSv/h
  EXPECT_EQ(readings.back().values[1].unit, "uSv");
  EXPECT_NEAR(readings.back().values[1].value, rate * 5 / 3600, 0.05 * rate * 5 / 3600);
  const auto warned = events(EventKind::dose_warning), limited = events(EventKind::dose_limit);
  ASSERT_EQ(warned.size(), 1U) << rate;
  ASSERT_EQ(limited.size(), 1U) << rate;
  EXPECT_EQ(limited[0].subject, "trainee");
  EXPECT_NEAR((limited[0].stamp - warned[0].stamp).seconds(), 0.005 / rate * 3600, 0.25);
}

TEST_F(LevelsTest, StopsWithAnEmptyBatteryAndReportsTheCharge) {
  Scenario scenario = hazardous();
  scenario.radio.reset();
  scenario.battery->idle = 50;
  start(level_1({}, scenario));
  run(2);
  EXPECT_NEAR(state_->tally.battery_left.value_or(-1), 0.5, 0.06);
  run(6, Twist2{0.2, 0, 0});
  EXPECT_EQ(events(EventKind::battery_low).size(), 1U);
  EXPECT_EQ(events(EventKind::battery_empty).size(), 1U);
  EXPECT_LT(motion().velocity.norm(), 0.01);
  EXPECT_EQ(state_->tally.battery_left, 0);
}

Message operator_at(std::int64_t utime, const std::string& robot, OperatorStatus::State state) {
  return test::message(channel::kOperators, utime,
                       OperatorStatus{SensorTime::from_utime(utime), "ann", robot, state, "keys"});
}

TEST_F(LevelsTest, DrivesOneRobotAtATimeAndStopsOnConsoleLoss) {
  start(level_1({test::agent("robot_1", AgentKind::robot, 2, 2, BehaviourKind::teleop)}));
  const auto report_operator = [this](const std::string& robot, OperatorStatus::State state) {
    feed(operator_at(teleop_at(time_, 0).arrival.utime(), robot, state));
    time_ += 0.05;
  };
  report_operator("trainee", OperatorStatus::State::drives);
  run(0.9, Twist2{0.4, 0, 0});
  EXPECT_GT(motion().velocity.x(), 0.3);
  report_operator("robot_1", OperatorStatus::State::drives);
  EXPECT_EQ(decoded<TwistCommand>(channel::kMrCmd).back().twist.vx, 0)
      << "the one that is left stops at once";
  report_operator("nobody", OperatorStatus::State::drives);
  EXPECT_THAT(state_->tally.last_refusal, HasSubstr("nobody"));
  EXPECT_EQ(events(EventKind::command_refused).size(), 1U);
  const auto switched = events(EventKind::operator_switched);
  ASSERT_EQ(switched.size(), 2U);
  EXPECT_EQ(switched[1].subject, "ann");
  EXPECT_EQ(switched[1].object, "robot_1");
  run(3);
  const auto lost = events(EventKind::console_lost);
  ASSERT_EQ(lost.size(), 1U) << "no messages for a second";
  EXPECT_EQ(lost[0].object, "robot_1");
  report_operator("trainee", OperatorStatus::State::drives);
  run(3.5, Twist2{0.4, 0, 0});
  report_operator("trainee", OperatorStatus::State::lost);
  EXPECT_EQ(events(EventKind::console_lost).size(), 2U);
  EXPECT_EQ(decoded<TwistCommand>(channel::kMrCmd).back().twist.vx, 0);
}

TEST_F(LevelsTest, AConsoleWhoseMessagesAreRefusedIsAnEventOnceInTenSeconds) {
  start(level_1());
  const auto report_operator = [this](const std::string& name) {
    const std::int64_t utime = teleop_at(time_, 0).arrival.utime();
    feed(test::message(channel::kOperators, utime,
                       OperatorStatus{SensorTime::from_utime(utime), name, "trainee",
                                      OperatorStatus::State::drives, "keys"}));
    time_ += 0.05;
  };
  for (int i = 0; i < 5; ++i) report_operator("Ann Miller\x1b[2J");
  const auto refused = events(EventKind::command_refused);
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_THAT(refused[0].text, HasSubstr("console of operator 'Ann Miller\\x1b[2J'"));
  EXPECT_THAT(refused[0].text, HasSubstr("letters, digits, '_' and '-'"));
  run(10.5);
  report_operator("Ann Miller");
  EXPECT_EQ(events(EventKind::command_refused).size(), 2U);
}

}  // namespace
}  // namespace parhelion::runtime
