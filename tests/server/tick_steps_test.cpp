// The same bytes whenever the loop did its steps: with a timer, late, or with physics that fails.
#include <gtest/gtest.h>

#include <map>
#include <stdexcept>
#include <string>

#include "protocols/sha256.hpp"
#include "tests/server/tick_fixture.hpp"

namespace parhelion {
namespace {

using test::agent;
using test::TickTest;

TEST_F(TickTest, TickGivesTheSameBytesHoweverOftenTheTimerTicks) {
  const auto run = [](bool with_timer) {
    const Configuration configuration =
        test::configuration({agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander)});
    auto state = *make_state(configuration, ArrivalTime::from_utime(test::start_us - 2000));
    Outputs outputs;
    StageObserver observer;
    std::map<std::string, Sha256> hashes;
    const auto keep = [&] {
      for (const Outputs::Entry& entry : outputs.entries()) hashes[entry.channel].add(entry.payload);
    };
    ArrivalTime last = ArrivalTime::from_utime(test::start_us - 2000);
    for (const Message& each : test::drive(3)) {
      for (; with_timer && last < each.arrival; last = last + microseconds(777)) {
        outputs.clear();
        advance(configuration, last, *state, outputs, observer);
        keep();
      }
      last = each.arrival;
      outputs.clear();
      tick(configuration, each, *state, outputs, observer);
      keep();
    }
    std::map<std::string, std::string> hex;
    for (auto& [channel, hash] : hashes) hex[channel] = hash.hex();
    return hex;
  };
  EXPECT_EQ(run(false), run(true));
}

/// A drive whose loop falls 0.6 s behind after 1 s; gives the hashes of what goes out on each channel.
/// `live`: the timer had done all steps until then, and how a scan was answered is noted when the disk lets
/// it. Otherwise from the log alone.
std::map<std::string, std::string> outputs_of_a_late_loop(bool live) {
  const Configuration configuration =
      test::configuration({agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander)});
  auto state = *make_state(configuration, ArrivalTime::from_utime(test::start_us - 2000));
  Outputs outputs;
  StageObserver observer;
  std::map<std::string, Sha256> hashes;
  const auto keep = [&] {
    for (const Outputs::Entry& entry : outputs.entries()) hashes[entry.channel].add(entry.payload);
    outputs.clear();
  };
  const auto take = [&](const Message& input) {
    tick(configuration, input, *state, outputs, observer);
    keep();
  };
  const auto decision = [](std::int64_t us, LoopDecision::Kind kind, std::int64_t count) {
    return test::message(channel::loop, us, LoopDecision{SensorTime::from_utime(us), kind, count});
  };
  for (const Message& each : test::drive(2)) {
    const std::int64_t us = each.arrival.utime() - test::start_us;
    if (us >= 900'000 && us < 1'600'000) continue;
    if (us >= 1'600'000 && us < 1'610'000) {
      if (live) {
        advance(configuration, ArrivalTime::from_utime(test::start_us + 1'000'000), *state, outputs,
                observer);
        keep();
      } else {
        take(decision(test::start_us + 1'590'000, LoopDecision::Kind::guard_fired, 9));
      }
      // At 240 Hz 143 steps are due since 1.0 s; the newest is done.
      take(decision(test::start_us + 1'595'000, LoopDecision::Kind::steps_skipped, 142));
    }
    take(each);
  }
  std::map<std::string, std::string> hex;
  for (auto& [channel, hash] : hashes) hex[channel] = hash.hex();
  return hex;
}

TEST_F(TickTest, TickSkipsTheStepsThatALateLoopSkippedAndDoesThoseThatItsTimerDid) {
  const auto live = outputs_of_a_late_loop(true);
  EXPECT_EQ(outputs_of_a_late_loop(false), live);
  EXPECT_TRUE(live.contains(channel::mr_world));
}

/// Fails in each seventh physics step.
class FaultyPhysics : public StageObserver {
 public:
  void ended(Stage stage) override {
    if (stage == Stage::physics_step && ++steps_ % 7 == 0) throw std::runtime_error("broken");
  }

 private:
  int steps_ = 0;
};

TEST_F(TickTest, TickGivesTheSameBytesHoweverOftenTheTimerTicksWherePhysicsIsFaulty) {
  const auto run = [](bool with_timer) {
    const Configuration configuration =
        test::configuration({agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander)});
    auto state = *make_state(configuration, ArrivalTime::from_utime(test::start_us - 2000));
    Outputs outputs;
    FaultyPhysics observer;
    std::map<std::string, std::vector<std::vector<std::uint8_t>>> all;
    ArrivalTime last = ArrivalTime::from_utime(test::start_us - 2000);
    for (const Message& each : test::drive(1)) {
      outputs.clear();
      for (; with_timer && last < each.arrival; last = last + microseconds(777))
        advance(configuration, last, *state, outputs, observer);
      last = each.arrival;
      tick(configuration, each, *state, outputs, observer);
      for (const Outputs::Entry& entry : outputs.entries()) all[entry.channel].push_back(entry.payload);
    }
    EXPECT_GT(state->tally.refused_inputs, 30U);
    EXPECT_LT(state->simulation.next_step().ns - last.ns, 5'000'000) << "it keeps up";
    return all;
  };
  EXPECT_EQ(run(false), run(true));
}

TEST_F(TickTest, TickNeverSkipsBeyondTheDecision) {
  start(test::configuration({}));
  const std::int64_t us = test::start_us + 1'000'000;
  feed(test::message(channel::loop, us,
                     LoopDecision{SensorTime::from_utime(us), LoopDecision::Kind::steps_skipped, 1'000'000}));
  EXPECT_LE(state_->simulation.now().ns, us * 1000);
  EXPECT_GT(state_->simulation.next_step().ns, us * 1000);
}

}  // namespace
}  // namespace parhelion
