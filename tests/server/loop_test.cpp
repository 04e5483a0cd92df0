// The live server over a memory bus: every scan answered, and its session log replays to the same bytes.
#include "server/loop.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "server/replay.hpp"
#include "server/wall_clock.hpp"
#include "tests/server/synthetic.hpp"

namespace parhelion {
namespace {

using test::agent;

class LoopTest : public testing::Test {
 protected:
  LoopTest() : server_bus_(hub_.connect()), robot_(hub_.connect()) {
    EXPECT_TRUE(robot_->subscribe("MR_.*", 10'000).ok());
  }
  ~LoopTest() override { stop(); }

  void serve_in_background(Configuration configuration, Duration guard = milliseconds(20)) {
    configuration_ = std::move(configuration);
    options_.session = folder_ / "session.lcm";
    options_.guard = guard;
    options_.stop = [this] {
      if (hold_up_.exchange(false)) std::this_thread::sleep_for(std::chrono::milliseconds(600));
      return stop_.load();
    };
    options_.say = [this](const std::string&) { started_ = true; };
    thread_ = std::thread([this] { report_.emplace(serve(*server_bus_, configuration_, options_)); });
    const WallTime deadline = steady_now() + seconds(20);
    while (!started_ && steady_now() < deadline) std::this_thread::yield();
    ASSERT_TRUE(started_);
  }
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  /// Plays a recording at `rate` times real time.
  void play(const std::vector<Message>& log, double rate) {
    const WallTime begun = steady_now();
    for (const Message& each : log) {
      const Duration due = seconds((each.arrival - log.front().arrival).seconds() / rate);
      while (steady_now() - begun < due) std::this_thread::sleep_for(std::chrono::microseconds(200));
      ASSERT_TRUE(robot_->publish(each.channel, each.payload).ok());
    }
  }
  /// Receives until `count` messages of a channel have come.
  std::vector<Message> await(const std::string& channel, std::size_t count) {
    std::vector<Message> all;
    Message message;
    while (all.size() < count) {
      const auto received = robot_->receive(message, seconds(20));
      if (!received.ok() || !*received) break;
      if (message.channel == channel) all.push_back(message);
    }
    return all;
  }

  test::Folder folder_;
  MemoryBusHub hub_;
  std::unique_ptr<Bus> server_bus_, robot_;
  Configuration configuration_;
  ServeOptions options_;
  std::atomic<bool> stop_ = false, started_ = false, hold_up_ = false;
  std::optional<Result<Report>> report_;
  std::thread thread_;
};

TEST_F(LoopTest, LoopAnswersEveryScanAndReplaysToTheSameBytes) {
  serve_in_background(test::configuration({agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander),
                                           agent("barrel_1", AgentKind::barrel, 0, 0)}),
                      seconds(10));
  const auto log = test::drive(2);
  play(log, 1.0);
  EXPECT_EQ(await(channel::mr_scan, 20).size(), 20U);
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  EXPECT_EQ(live.tally.scans_in, 20U);
  EXPECT_GT(live.tally.beams_replaced, 0U);

  ReplayOptions again;
  again.log = folder_ / "session.lcm";
  const auto replayed = replay(again);
  ASSERT_TRUE(replayed.ok()) << replayed.error().message;
  for (const char* name : {channel::mr_session, channel::mr_scan, channel::mr_scan_info}) {
    EXPECT_EQ(replayed->hash.at(name), live.hash.at(name)) << name;
  }
}

TEST_F(LoopTest, LoopThatWasHeldUpReplaysToTheSameBytes) {
  serve_in_background(test::configuration({agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander)}));
  const auto log = test::drive(3);
  const auto middle = log.begin() + static_cast<std::ptrdiff_t>(log.size() / 2);
  play({log.begin(), middle}, 1.0);
  hold_up_ = true;
  play({middle, log.end()}, 1.0);
  EXPECT_EQ(await(channel::mr_scan, 30).size(), 30U);
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  EXPECT_GT(live.guard_fired, 0U);

  ReplayOptions again;
  again.log = folder_ / "session.lcm";
  const auto replayed = replay(again);
  ASSERT_TRUE(replayed.ok()) << replayed.error().message;
  EXPECT_EQ(replayed->arrivals_corrected, 0U) << "each decision of the loop has a stamp of its own";
  EXPECT_EQ(replayed->tally.scans_degraded, live.tally.scans_degraded);
  for (const char* name : {channel::mr_session, channel::mr_scan, channel::mr_scan_info}) {
    EXPECT_EQ(replayed->hash.at(name), live.hash.at(name)) << name;
  }
}

TEST_F(LoopTest, LoopAcknowledgesACommandOnlyAfterItIsInTheLog) {
  serve_in_background(test::configuration({}));
  AgentCommand command;
  command.request = 99;
  command.stamp = {wall_now().ns};
  command.agent = agent("box_1", AgentKind::box, 3, 2);
  const Message message = test::message(channel::mr_agent_cmd, 0, command);
  ASSERT_TRUE(robot_->publish(message.channel, message.payload).ok());
  bool accepted = false;
  while (!accepted) {
    const auto events = await(channel::mr_events, 1);
    ASSERT_EQ(events.size(), 1U);
    Event event;
    ASSERT_TRUE(decode(events[0].channel, events[0].payload, event).ok());
    accepted = event.request == 99 && event.kind == EventKind::command_accepted;
    // The server still runs: what is in the file now is what a kill would leave.
    auto reader = LogReader::open(folder_ / "session.lcm");
    ASSERT_TRUE(reader.ok());
    bool found = false;
    while (true) {
      const auto next = reader->next();
      if (!next.ok() || !*next) break;
      found = found || ((*next)->channel == channel::mr_agent_cmd && (*next)->payload == message.payload);
    }
    EXPECT_TRUE(found);
  }
}

}  // namespace
}  // namespace parhelion
