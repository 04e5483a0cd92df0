// A live session on its own thread, connected to a test by a memory bus.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <span>
#include <thread>

#include "server/runtime/loop.hpp"
#include "server/runtime/replay.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/server/tick/same_bytes.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::test {

/// A live session over a memory bus: the test acts as the robot.
class LoopTest : public testing::Test {
 protected:
  LoopTest() : server_bus_(hub_.connect()), robot_(hub_.connect()) {
    EXPECT_TRUE(robot_->subscribe("MR_.*", 10'000).ok());
  }
  ~LoopTest() override { stop(); }

  void serve_in_background(tick::Configuration configuration, Duration guard = milliseconds(20)) {
    configuration_ = std::move(configuration);
    options_.session = folder_ / "session.lcm";
    options_.guard = guard;
    options_.stop = [this] {
      while (gate_shut_) {
        at_gate_ = true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      at_gate_ = false;
      return stop_.load();
    };
    options_.notify = [this](const std::string& news) {
      notices_.push_back(news);
      started_ = true;
    };
    thread_ =
        std::thread([this] { report_.emplace(runtime::serve(*server_bus_, configuration_, options_)); });
    const WallTime deadline = runtime::steady_now() + seconds(20);
    while (!started_ && runtime::steady_now() < deadline) std::this_thread::yield();
    ASSERT_TRUE(started_);
  }
  void stop() {
    stop_ = true;
    open_gate();
    if (thread_.joinable()) thread_.join();
  }
  /// Plays a recording at `rate` times real time.
  void play(const std::vector<Message>& log, double rate) {
    const WallTime begun = runtime::steady_now();
    for (const Message& each : log) {
      const Duration due = seconds((each.arrival - log.front().arrival).seconds() / rate);
      while (runtime::steady_now() - begun < due) std::this_thread::sleep_for(std::chrono::microseconds(200));
      ASSERT_TRUE(robot_->publish(each.channel, each.payload).ok());
    }
  }
  /// Receives until `count` messages of a channel have arrived.
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

  /// Receives until the last scan of a recording was published; keeps the scans.
  bool await_scan(std::span<const Message> log) {
    const std::int64_t last = stamps({log.begin(), log.end()}, channel::kScan).back();
    Message message;
    while (true) {
      const auto received = robot_->receive(message, seconds(20));
      if (!received.ok() || !*received) return false;
      if (message.channel != channel::kMrScan) continue;
      received_.push_back(message);
      if (leading_stamp(message.payload)->utime() == last) return true;
    }
  }
  /// Blocks the loop until open_gate(). The guard and the inbox continue.
  void shut_gate() {
    gate_shut_ = true;
    while (!at_gate_) std::this_thread::yield();
  }
  void open_gate() { gate_shut_ = false; }
  /// Receives until the physics is this far beyond the last input.
  bool await_timer(Duration beyond) {
    const WallTime from = runtime::wall_now();
    Message message;
    while (true) {
      const auto received = robot_->receive(message, seconds(20));
      if (!received.ok() || !*received) return false;
      if (message.channel == channel::kMrWorld && leading_stamp(message.payload)->ns >= from.ns + beyond.ns)
        return true;
    }
  }

  /// The stamps of the scans among messages, in order, us.
  static std::vector<std::int64_t> stamps(const std::vector<Message>& messages, const std::string& channel) {
    std::vector<std::int64_t> all;
    for (const Message& each : messages) {
      if (each.channel == channel) all.push_back(leading_stamp(each.payload)->utime());
    }
    return all;
  }
  std::vector<Message> session_log() {
    std::vector<Message> all;
    auto reader = LogReader::open(folder_ / "session.lcm");
    EXPECT_TRUE(reader.ok());
    while (reader.ok()) {
      auto next = reader->next();
      EXPECT_TRUE(next.ok()) << next.error().message;
      if (!next.ok() || !*next) break;
      all.push_back(std::move(**next));
    }
    return all;
  }
  void expect_same_bytes_again(const runtime::Report& live) {
    runtime::ReplayOptions again;
    again.log = folder_ / "session.lcm";
    again.session = folder_ / "again.lcm";
    const auto replayed = runtime::replay(again);
    ASSERT_TRUE(replayed.ok()) << replayed.error().message;
    EXPECT_EQ(replayed->arrivals_corrected, 0U) << "each decision of the loop has a stamp of its own";
    EXPECT_EQ(replayed->tally.scans_in, live.tally.scans_in);
    EXPECT_EQ(replayed->tally.scans_out, live.tally.scans_out);
    EXPECT_EQ(replayed->tally.scans_degraded, live.tally.scans_degraded);
    EXPECT_EQ(replayed->complete, live.complete);
    EXPECT_EQ(replayed->hash, live.hash) << test::difference(again.log, again.session);
  }

  test::TemporaryFolder folder_;
  MemoryBusHub hub_;
  std::unique_ptr<Bus> server_bus_, robot_;
  tick::Configuration configuration_;
  runtime::ServeOptions options_;
  std::atomic<bool> stop_ = false, started_ = false;
  std::atomic<bool> gate_shut_ = false, at_gate_ = false;
  std::vector<Message> received_;     ///< MR_SCAN, from await_scan()
  std::vector<std::string> notices_;  ///< messages for people; complete after stop()
  std::optional<Result<runtime::Report>> report_;
  std::thread thread_;
};

}  // namespace parhelion::test
