// What stops a real robot without anybody's command, and what it takes until it moves again.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using testing::HasSubstr;

class StopsTest : public test::TickTest {
 protected:
  void SetUp() override { start(test::configuration({})); }

  static std::int64_t us(double s) { return test::kStartUs + static_cast<std::int64_t>(s * 1e6); }
  /// TELEOP 20 times a second from `begin` to `end`, s.
  void hold(double begin, double end, const Twist2& twist = {0.3, 0, 0}) {
    for (double t = begin; t < end - 1e-6; t += 0.05)
      log_.push_back(
          test::message(channel::kTeleop, us(t) + 7, TwistCommand{SensorTime::from_utime(us(t)), twist}));
  }
  void claim(double t, const std::string& name) {
    log_.push_back(
        test::message(channel::kOperators, us(t),
                      OperatorStatus{SensorTime::from_utime(us(t)), name, configuration_.robot.name,
                                     OperatorStatus::State::drives, "console"}));
  }
  void claim_agent(double t, const std::string& name) {
    log_.push_back(test::message(channel::kOperators, us(t),
                                 OperatorStatus{SensorTime::from_utime(us(t)), name, "helper",
                                                OperatorStatus::State::drives, "console"}));
  }
  /// A drive without the messages of `channel` from `begin` to `end`.
  void drive_without(double duration, const std::string& channel, double begin, double end) {
    for (Message& each : test::drive(duration)) {
      if (each.channel != channel || each.arrival.utime() < us(begin) || each.arrival.utime() >= us(end))
        log_.push_back(std::move(each));
    }
  }
  void run() {
    std::stable_sort(log_.begin(), log_.end(),
                     [](const auto& a, const auto& b) { return a.arrival < b.arrival; });
    for (const Message& each : log_) {
      const std::size_t before = out_[channel::kMrCmd].size();
      feed(each);
      for (std::size_t i = before; i < out_[channel::kMrCmd].size(); ++i) {
        TwistCommand command;
        ASSERT_TRUE(decode(channel::kMrCmd, out_[channel::kMrCmd][i], command).ok());
        commands_.emplace_back((each.arrival.utime() - test::kStartUs) * 1e-6, command.twist);
      }
    }
  }
  /// Whether any command from `begin` to `end` moves the robot.
  bool moves(double begin, double end) const {
    return std::any_of(commands_.begin(), commands_.end(), [&](const auto& each) {
      const Twist2& twist = each.second;
      return each.first >= begin && each.first < end && (twist.vx != 0 || twist.vy != 0 || twist.wz != 0);
    });
  }
  std::vector<std::string> texts(EventKind kind) {
    std::vector<std::string> all;
    for (const Event& event : decoded<Event>(channel::kMrEvents))
      if (event.kind == kind) all.push_back(event.text);
    return all;
  }

  std::vector<Message> log_;
  std::vector<std::pair<double, Twist2>> commands_;  // s of arrival
};

TEST_F(StopsTest, ASlamThatFallsSilentWhileTheRobotMovesIsALostPose) {
  drive_without(16, channel::kPoseCov, 3, 12);  // 0.24 m/s: a metre from 3 s on is passed at 7.4 s
  hold(1, 14);
  hold(14.6, 15.5);
  run();
  EXPECT_TRUE(moves(1, 3));
  EXPECT_TRUE(moves(6, 7)) << "odometry carries the pose for a while";
  EXPECT_FALSE(moves(8.5, 12)) << "stopped, though the stick is held";
  const auto lost = texts(EventKind::localization_lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_THAT(lost[0], HasSubstr("no estimate from SLAM for 4."));
  EXPECT_THAT(lost[0], HasSubstr("1.0"));
  EXPECT_FALSE(texts(EventKind::localized).empty());
  EXPECT_FALSE(moves(12, 14)) << "localized again, but the dead-man was not released";
  EXPECT_THAT(texts(EventKind::speed_limited), testing::Contains("dead_man_not_released"));
  EXPECT_TRUE(moves(14.6, 15.5));
}

TEST_F(StopsTest, ARobotWhoseScansStoppedStandsUntilTheyComeAndTheDeadManWasReleased) {
  drive_without(10, channel::kScan, 3, 6);
  hold(1, 8);
  hold(8.6, 9.5);
  run();
  EXPECT_TRUE(moves(3, 3.9)) << "a gap";
  EXPECT_FALSE(moves(4.1, 8));
  EXPECT_THAT(texts(EventKind::speed_limited),
              testing::ElementsAre("scans_silent", "dead_man_not_released", "silence"));
  EXPECT_TRUE(moves(8.6, 9.5));
}

TEST_F(StopsTest, ARobotThatNeverScannedIsNotStoppedForIt) {
  drive_without(4, channel::kScan, -1, 5);
  hold(1, 4);
  run();
  EXPECT_TRUE(moves(3, 4));
}

TEST_F(StopsTest, ASlowLaserIsNotSilent) {
  drive_without(12, channel::kScan, -1, 13);
  for (int i = 0; i < 6; ++i)
    log_.push_back(test::message(channel::kScan, us(2.0 * i) + 5000, test::scan_at(2.0 * i)));
  hold(4.5, 11.5);
  run();
  EXPECT_TRUE(moves(5.5, 6));
  EXPECT_TRUE(texts(EventKind::speed_limited).empty() ||
              !testing::Value(texts(EventKind::speed_limited), testing::Contains("scans_silent")));
}

TEST_F(StopsTest, TwoConsolesOfOneRobotStopIt) {
  drive_without(8, channel::kTeleop, 0, 0);
  hold(1, 5, {0.2, 0, 0.1});
  for (double t = 0.9; t < 7; t += 0.4) claim(t, "ann"), claim(t + 0.1, "bob");
  for (double t = 3.02; t < 4; t += 0.05)  // the other console's, between them
    log_.push_back(
        test::message(channel::kTeleop, us(t), TwistCommand{SensorTime::from_utime(us(t)), {-0.2, 0, -0.1}}));
  hold(5.6, 7, {0.2, 0, 0.1});
  run();
  EXPECT_TRUE(moves(1, 3));
  EXPECT_FALSE(moves(3.25, 5)) << "until the dead-man was released";
  EXPECT_TRUE(moves(5.6, 7));
  const auto refused = texts(EventKind::command_refused);
  EXPECT_EQ(std::count_if(refused.begin(), refused.end(),
                          [](const std::string& text) {
                            return text.find("two consoles drive robot") != std::string::npos;
                          }),
            1);
  EXPECT_LE(texts(EventKind::speed_limited).size(), 5U) << "not for each command";
}

TEST_F(StopsTest, AProgramThatAlternatesItsCommandsIsNotTwoConsoles) {
  drive_without(8, channel::kTeleop, 0, 0);
  for (double t = 0.9; t < 7; t += 0.4) claim(t, "ann");
  for (int i = 20; i < 140; ++i) {
    const double t = 0.05 * i;
    log_.push_back(
        test::message(channel::kTeleop, us(t) + 7,
                      TwistCommand{SensorTime::from_utime(us(t)), {0.2, 0, i % 2 == 0 ? 0.4 : -0.4}}));
  }
  run();
  EXPECT_TRUE(texts(EventKind::command_refused).empty());
  EXPECT_TRUE(moves(5, 6.5));
}

/// A hand is not two consoles: it pushes a stick to and fro, and hits a key as fast as it can.
TEST_F(StopsTest, AShakenStickIsNotTwoConsoles) {
  drive_without(8, channel::kTeleop, 0, 0);
  for (int i = 20; i < 140; ++i) {
    const double t = 0.05 * i, vx = t < 4 ? 0.3 * std::sin(2 * std::numbers::pi * 4 * t) : i / 2 % 2 * 0.3;
    log_.push_back(
        test::message(channel::kTeleop, us(t) + 7, TwistCommand{SensorTime::from_utime(us(t)), {vx, 0, 0}}));
  }
  run();
  EXPECT_TRUE(texts(EventKind::command_refused).empty());
}

TEST_F(StopsTest, AnotherConsolesClaimIsRefusedWhileTheDeadManIsHeld) {
  drive_without(5, channel::kTeleop, 0, 0);
  hold(1, 3);
  for (double t = 0.9; t < 5; t += 0.4) claim(t, "ann");
  for (double t = 2.0; t < 5; t += 0.4) claim(t, "bob");
  run();
  ASSERT_EQ(texts(EventKind::command_refused).size(), 1U);
  EXPECT_THAT(texts(EventKind::command_refused)[0], HasSubstr("'bob': 'ann' drives"));
  EXPECT_TRUE(moves(2.2, 3)) << "a refused claim disturbs nobody";
  std::vector<std::string> drivers;
  for (const Event& event : decoded<Event>(channel::kMrEvents))
    if (event.kind == EventKind::operator_switched) drivers.push_back(event.subject);
  EXPECT_THAT(drivers, testing::ElementsAre("ann", "bob")) << "accepted once the dead-man was released";
}

/// As after a crash: whoever drove the robot still pushes the stick when the server is back.
TEST_F(StopsTest, ADeadManThatIsHeldWhenTheServerStartsMovesNothing) {
  drive_without(5, channel::kTeleop, 0, 0);
  hold(0.1, 3);
  hold(3.6, 4.5);
  run();
  EXPECT_FALSE(moves(0, 3));
  EXPECT_THAT(texts(EventKind::speed_limited), testing::Contains("dead_man_not_released"));
  EXPECT_TRUE(moves(3.6, 4.5));
}

TEST_F(StopsTest, AMessageThatCannotBeReadIsNoRelease) {
  drive_without(5, channel::kTeleop, 0, 0);
  hold(0.1, 3);
  log_.push_back({channel::kTeleop, ArrivalTime::from_utime(us(1.51)), {1, 2, 3}});
  run();
  EXPECT_FALSE(moves(0, 3));
}

TEST_F(StopsTest, AShortGapOfOdometryIsNoLoss) {
  for (Message& each : test::drive(6)) {
    const std::int64_t at = each.arrival.utime();
    if (each.channel != channel::kOdometry || at < us(3) || at > us(3.6)) log_.push_back(std::move(each));
  }
  hold(1, 5);
  run();
  EXPECT_TRUE(texts(EventKind::localization_lost).empty());
  EXPECT_TRUE(moves(4, 5)) << "without a release";
}

TEST_F(StopsTest, ALocalizationThatJumpsAtEachEstimateIsOneLoss) {
  log_ = test::drive(14);
  for (Message& each : log_) {
    const double t = (each.arrival.utime() - test::kStartUs) * 1e-6;
    if (each.channel != channel::kPoseCov || t < 3 || t > 8) continue;
    PoseEstimate estimate;
    ASSERT_TRUE(decode(each.channel, each.payload, estimate).ok());
    const double off = static_cast<int>(10 * t) % 2 == 0 ? 3 : -1;
    estimate.T_map_base = Transform<Map, Base>::planar(estimate.T_map_base.translation().x() + off,
                                                       estimate.T_map_base.translation().y(), 0);
    encode(estimate, each.payload);
  }
  run();
  EXPECT_LE(texts(EventKind::relocalized).size(), 2U);
  ASSERT_EQ(texts(EventKind::localization_lost).size(), 1U);
  EXPECT_THAT(texts(EventKind::localization_lost)[0], HasSubstr("jumps"));
  EXPECT_EQ(texts(EventKind::localized).size(), 2U) << "at the start, and when it was steady again";
}

TEST_F(StopsTest, OneKindOfRefusedMessagesDoesNotHideAnother) {
  feed(test::drive(1));
  for (int i = 0; i < 50; ++i) {
    feed({channel::kPoseCov, ArrivalTime::from_utime(us(1.1) + 100 * i), {1, 2, 3}});
    feed({channel::kImu, ArrivalTime::from_utime(us(1.1) + 100 * i + 50), {1, 2, 3}});
  }
  const auto& refusals = state_->tally.refusals;
  ASSERT_EQ(refusals.size(), 2U);
  EXPECT_THAT(refusals[0].text, HasSubstr("POSE_COV"));
  EXPECT_EQ(refusals[0].count, 50U);
  EXPECT_THAT(refusals[1].text, HasSubstr("IMU"));
}

/// Names come from the bus. Each switch is an event in the log.
TEST_F(StopsTest, OperatorsAndTheirSwitchesAreBounded) {
  for (int i = 0; i < 3000; ++i) claim(1 + i * 0.001, "operator_" + std::to_string(i));
  std::size_t max_count = 0;
  for (const Message& each : log_) {
    feed(each);
    max_count = std::max(max_count, state_->operators.size());
  }
  EXPECT_LE(max_count, kMaxOperators);
  const auto switched = [&] { return texts(EventKind::operator_switched).size(); };
  EXPECT_LE(switched(), 4U * SwitchBudget::kMaxPerSecond);
  EXPECT_GE(switched(), 3U * SwitchBudget::kMaxPerSecond);
  const std::size_t before = switched();
  log_.clear();
  claim(6, "anna");
  feed(log_.front());
  EXPECT_EQ(switched(), before + 1) << "when the flood is over";
  EXPECT_TRUE(state_->operators.contains("anna"));
}

/// New names, each claimed once: they take neither the places nor the switches of consoles, which repeat
/// theirs.
TEST_F(StopsTest, AFloodOfNewOperatorsKeepsNoConsoleOut) {
  for (const int rate : {64, 1000, 4000}) {
    start(test::configuration({}));
    log_.clear();
    for (int i = 0; i < 4 * rate; ++i)
      claim(1 + i / static_cast<double>(rate), "operator_" + std::to_string(i));
    for (double t = 1.50003; t < 5; t += 0.4) claim(t, "anna");
    std::stable_sort(log_.begin(), log_.end(),
                     [](const auto& a, const auto& b) { return a.arrival < b.arrival; });
    double entered = 0;
    for (const Message& each : log_) {
      feed(each);
      const double t = (each.arrival.utime() - test::kStartUs) * 1e-6;
      if (entered == 0 && state_->operators.contains("anna")) entered = t;
      ASSERT_TRUE(entered == 0 || state_->operators.contains("anna")) << rate << " at " << t;
    }
    EXPECT_GT(entered, 0) << rate;
    EXPECT_LE(entered, 3.5) << rate;
  }
}

/// As many names as there are places, all repeated: whoever drives keeps her place, and so does whoever came
/// before them.
TEST_F(StopsTest, AnOperatorWhoDrivesKeepsHisPlace) {
  drive_without(8, channel::kTeleop, 0, 0);
  hold(1, 7.5);
  for (double t = 0.5; t < 7.5; t += 0.4) claim(t, "anna");
  for (double t = 2; t < 7.5; t += 0.5)  // of another robot, since anna holds the dead-man of hers
    for (int i = 0; i < 100; ++i) claim_agent(t + i * 1e-3, "operator_" + std::to_string(i));
  for (double t = 1.9; t < 7.5; t += 0.4) claim_agent(t + 0.0003, "bob");
  start(test::configuration({agent("helper", AgentKind::robot, 3, 2)}));
  run();
  EXPECT_TRUE(state_->operators.contains("anna"));
  EXPECT_EQ(state_->operators.size(), kMaxOperators);
  std::vector<std::string> entered;
  for (const Event& event : decoded<Event>(channel::kMrEvents)) {
    if (event.kind == EventKind::operator_switched) entered.push_back(event.subject);
    if (event.kind != EventKind::console_lost) continue;
    EXPECT_THAT(event.subject, testing::AllOf(testing::Ne("anna"), testing::Ne("bob"))) << event.text;
  }
  EXPECT_THAT(entered, testing::Contains("bob"));
  EXPECT_LE(entered.size(), 8U * 2 * SwitchBudget::kMaxPerSecond);
  EXPECT_TRUE(moves(6, 7));
}

/// 64 operators who came after bob, on the way into the session: his claims at 2 s and 2.4 s are one name
/// that is repeated.
class DisplacedTest : public StopsTest {
 protected:
  void SetUp() override {
    start(test::configuration({test::agent("helper", AgentKind::robot, 3, 2, BehaviourKind::teleop)}));
    advance_to(ArrivalTime::from_utime(us(1.9)));
    for (std::size_t i = 0; i < kMaxOperators; ++i) {
      const auto since = ArrivalTime::from_utime(us(2.1) + static_cast<std::int64_t>(i));
      state_->operators[name(i)] = {configuration_.robot.name, since, since, since, {}};
    }
  }
  static std::string name(std::size_t i) { return "operator_" + std::to_string(i); }
  /// The newest TELEOP of the helper, at 2.3 s.
  void drive_helper(const Twist2& twist) {
    log_.push_back(test::message("MR_AGENT_helper_TELEOP", us(2.3) + 7,
                                 TwistCommand{SensorTime::from_utime(us(2.3)), twist}));
  }
  /// Whose place bob gets; empty: nobody's.
  std::string displaced() {
    claim(2.0, "bob");
    claim(2.4, "bob");
    run();
    EXPECT_EQ(state_->operators.size(), kMaxOperators);
    std::string gone;
    for (std::size_t i = 0; i < kMaxOperators; ++i)
      if (!state_->operators.contains(name(i))) gone += name(i);
    EXPECT_EQ(state_->operators.contains("bob"), !gone.empty());
    return gone;
  }
};

TEST_F(DisplacedTest, TheLongestIdleLeaves) {
  const auto t = [](double s) { return SimulationTime{ArrivalTime::from_utime(us(s)).ns}; };
  for (auto& each : state_->operators) each.second.drove = t(1.5);
  state_->operators.at(name(7)).drove = t(1.5 - kDriverKept.seconds());
  state_->operators.at(name(8)).drove = t(1.0 - kDriverKept.seconds());
  EXPECT_EQ(displaced(), name(8));
}

TEST_F(DisplacedTest, NobodyWhoHasJustDrivenLeaves) {
  for (auto& each : state_->operators)
    each.second.drove = SimulationTime{ArrivalTime::from_utime(us(1.5)).ns};
  EXPECT_EQ(displaced(), "");
}

TEST_F(DisplacedTest, NobodyWhoCameBeforeLeaves) {
  for (auto& each : state_->operators) each.second.since = ArrivalTime::from_utime(us(1.99));
  EXPECT_EQ(displaced(), "");
}

TEST_F(DisplacedTest, WhoDrivesAnAgentKeepsHisPlace) {
  state_->operators.at(name(0)).robot = "helper";
  drive_helper({0.3, 0, 0});
  EXPECT_EQ(displaced(), name(1));
  EXPECT_TRUE(state_->simulation.is_driven("helper")) << "it was not stopped";
}

TEST_F(DisplacedTest, WhoHoldsAnAgentStillMayLeave) {
  state_->operators.at(name(0)).robot = "helper";
  drive_helper({0, 0, 0});
  EXPECT_EQ(displaced(), name(0));
}

/// A stranger's claim of the same robot takes nothing from whoever claimed it first.
TEST_F(StopsTest, WhoClaimedARobotFirstHasDrivenIt) {
  drive_without(4, channel::kTeleop, 0, 0);
  hold(1.5, 3.5);
  for (double t = 0.5; t < 3.5; t += 0.4) claim(t, "zoe");
  for (double t = 0.7; t < 3.5; t += 0.4) claim(t, "anna");
  run();
  ASSERT_TRUE(state_->operators.contains("zoe") && state_->operators.contains("anna"));
  EXPECT_TRUE(state_->operators.at("zoe").drove);
  EXPECT_FALSE(state_->operators.at("anna").drove);
}

/// More consoles than places, at any phase: those outside do not take the places of those inside in turn.
TEST_F(StopsTest, ConsolesThatFindNoPlaceDisplaceNobodyForEver) {
  std::mt19937 random(20261130);
  std::uniform_real_distribution<double> begin(1, 5), shift(-0.05, 0.05);
  for (int i = 0; i < 80; ++i) {
    for (double t = begin(random); t < 20; t += 0.4) claim(t + shift(random), "console_" + std::to_string(i));
  }
  run();
  EXPECT_EQ(state_->operators.size(), kMaxOperators);
  std::size_t all = 0, late = 0;
  for (const Event& event : decoded<Event>(channel::kMrEvents)) {
    if (event.kind != EventKind::operator_switched && event.kind != EventKind::console_lost) continue;
    ++all;
    late += event.stamp >= SimulationTime{ArrivalTime::from_utime(us(8)).ns};
  }
  EXPECT_LE(all, 3 * 80U);
  EXPECT_EQ(late, 0U);
}

/// Whose switch is refused drives nothing any more: the robot must not stay his.
TEST_F(StopsTest, AnOperatorWhoseSwitchIsRefusedLeavesTheRobot) {
  start(test::configuration({agent("helper", AgentKind::robot, 3, 2)}));
  claim(1, "anna");
  for (int i = 0; i < 100; ++i) claim(1.1 + i * 1e-4, "operator_" + std::to_string(i));
  claim_agent(1.15, "anna");
  for (std::size_t i = 0; i + 1 < log_.size(); ++i) feed(log_[i]);
  ASSERT_EQ(state_->operators.at("anna").robot, configuration_.robot.name);
  feed(log_.back());
  EXPECT_FALSE(state_->operators.contains("anna")) << "so soon, her name is not repeated";
}

}  // namespace
}  // namespace parhelion::tick
