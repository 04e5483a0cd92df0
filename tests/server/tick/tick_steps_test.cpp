// The same bytes independent of when the loop does its steps: with a timer, late, or with failing physics.
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using test::agent;
using test::TickTest;

/// A tick driven by messages and by a timer; keeps the outputs of each channel, in order.
class TimedTick {
 public:
  using Sent = std::map<std::string, std::vector<std::vector<std::uint8_t>>>;

  TimedTick(const AgentDefinition& other, StageObserver& observer)
      : configuration_(test::configuration({other})),
        state_(*make_state(configuration_, last_)),
        observer_(observer) {}

  void take(const Message& input) {
    last_ = input.arrival;
    outputs_.clear();
    tick(configuration_, input, *state_, outputs_, observer_);
    keep();
  }
  void advance_to(ArrivalTime time) {
    outputs_.clear();
    advance(configuration_, time, *state_, outputs_, observer_);
    keep();
  }
  /// The timer of a live loop, from the last input to the next.
  void tick_until(ArrivalTime next) {
    for (ArrivalTime time = last_; time < next; time = time + microseconds(777)) advance_to(time);
  }

  const Sent& sent() const { return sent_; }
  const State& state() const { return *state_; }
  ArrivalTime last() const { return last_; }

 private:
  void keep() {
    for (const Outputs::Entry& entry : outputs_.entries()) sent_[entry.channel].push_back(entry.payload);
  }

  ArrivalTime last_ = ArrivalTime::from_utime(test::kStartUs - 2000);
  Configuration configuration_;
  std::unique_ptr<State> state_;
  StageObserver& observer_;
  Outputs outputs_;
  Sent sent_;
};

TEST_F(TickTest, TickIsIdenticalForAnyTimerRate) {
  const auto run = [](bool with_timer) {
    StageObserver observer;
    TimedTick ticks(agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander), observer);
    for (const Message& each : test::drive(3)) {
      if (with_timer) ticks.tick_until(each.arrival);
      ticks.take(each);
    }
    return ticks.sent();
  };
  EXPECT_TRUE(run(false) == run(true));
}

/// A drive whose loop falls 0.6 s behind after 1 s. `live`: the timer had done all steps until then, and the
/// result of a scan is noted when the disk permits. Otherwise only from the log.
TimedTick::Sent sent_by_a_late_loop(bool live) {
  StageObserver observer;
  TimedTick ticks(agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander), observer);
  const auto decision = [](std::int64_t us, LoopDecision::Kind kind, std::int64_t count) {
    return test::message(channel::kLoop, us, LoopDecision{SensorTime::from_utime(us), kind, count});
  };
  for (const Message& each : test::drive(2)) {
    const std::int64_t us = each.arrival.utime() - test::kStartUs;
    if (us >= 900'000 && us < 1'600'000) continue;
    if (us >= 1'600'000 && us < 1'610'000) {
      if (live) {
        ticks.advance_to(ArrivalTime::from_utime(test::kStartUs + 1'000'000));
      } else {
        ticks.take(decision(test::kStartUs + 1'590'000, LoopDecision::Kind::guard_fired, 9));
      }
      // At 240 Hz 143 steps are due since 1.0 s; the newest is done.
      ticks.take(decision(test::kStartUs + 1'595'000, LoopDecision::Kind::steps_skipped, 142));
    }
    ticks.take(each);
  }
  return ticks.sent();
}

TEST_F(TickTest, TickReplaysSkippedAndTimerStepsOfALateLoop) {
  const auto live = sent_by_a_late_loop(true);
  EXPECT_TRUE(sent_by_a_late_loop(false) == live);
  EXPECT_TRUE(live.contains(channel::kMrWorld));
}

TEST_F(TickTest, TickReportsMissingScansBeforeLeftOutOnes) {
  const auto run = [](bool with_timer) {
    StageObserver observer;
    TimedTick ticks(agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander), observer);
    const std::int64_t us = test::kStartUs + 700'000;
    if (with_timer) ticks.tick_until(ArrivalTime::from_utime(us));
    ticks.take(test::message(
        channel::kLoop, us, LoopDecision{SensorTime::from_utime(us), LoopDecision::Kind::scans_left_out, 3}));
    EXPECT_EQ(ticks.state().tally.scans_in, 3U);
    return ticks.sent();
  };
  const auto sent = run(true);
  EXPECT_TRUE(sent.contains(channel::kMrEvents));
  EXPECT_TRUE(run(false) == sent);
}

/// Fails in every seventh physics step.
class FaultyPhysics : public StageObserver {
 public:
  void ended(Stage stage) override {
    if (stage == Stage::physics_step && ++steps_ % 7 == 0) throw std::runtime_error("broken");
  }

 private:
  int steps_ = 0;
};

TEST_F(TickTest, TickIsIdenticalForAnyTimerRateWithFaultyPhysics) {
  const auto run = [](bool with_timer) {
    FaultyPhysics observer;
    TimedTick ticks(agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander), observer);
    for (const Message& each : test::drive(1)) {
      if (with_timer) ticks.tick_until(each.arrival);
      ticks.take(each);
    }
    EXPECT_GT(ticks.state().tally.refused_inputs, 30U);
    EXPECT_LT(ticks.state().simulation.next_step().ns - ticks.last().ns, 5'000'000) << "it keeps up";
    return ticks.sent();
  };
  EXPECT_TRUE(run(false) == run(true));
}

TEST_F(TickTest, TickNeverSkipsBeyondTheDecision) {
  start(test::configuration({}));
  const std::int64_t us = test::kStartUs + 1'000'000;
  feed(test::message(channel::kLoop, us,
                     LoopDecision{SensorTime::from_utime(us), LoopDecision::Kind::steps_skipped, 1'000'000}));
  EXPECT_LE(state_->simulation.now().ns, us * 1000);
  EXPECT_GT(state_->simulation.next_step().ns, us * 1000);
}

}  // namespace
}  // namespace parhelion::tick
