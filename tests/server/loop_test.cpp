// The live server over a memory bus: every scan answered, and its session log replays to the same bytes.
#include "server/loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <span>
#include <thread>

#include "server/replay.hpp"
#include "server/wall_clock.hpp"
#include "tests/server/level_1.hpp"
#include "tests/server/same_bytes.hpp"
#include "tests/server/synthetic.hpp"
#include "tests/slow_disk.hpp"

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
      while (gate_shut_) {
        at_gate_ = true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      at_gate_ = false;
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
    open_gate();
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

  /// Receives until the last scan of a recording has gone out; keeps the scans.
  bool await_scan(std::span<const Message> log) {
    const std::int64_t last = stamps({log.begin(), log.end()}, channel::scan).back();
    Message message;
    while (true) {
      const auto received = robot_->receive(message, seconds(20));
      if (!received.ok() || !*received) return false;
      if (message.channel != channel::mr_scan) continue;
      heard_.push_back(message);
      if (leading_stamp(message.payload)->utime() == last) return true;
    }
  }
  /// Holds the loop up until open_gate(). The guard and the inbox go on.
  void shut_gate() {
    gate_shut_ = true;
    while (!at_gate_) std::this_thread::yield();
  }
  void open_gate() { gate_shut_ = false; }
  /// Receives until the physics has got so far beyond the input that came last.
  bool await_timer(Duration beyond) {
    const WallTime from = wall_now();
    Message message;
    while (true) {
      const auto received = robot_->receive(message, seconds(20));
      if (!received.ok() || !*received) return false;
      if (message.channel == channel::mr_world && leading_stamp(message.payload)->ns >= from.ns + beyond.ns)
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
  void expect_same_bytes_again(const Report& live) {
    ReplayOptions again;
    again.log = folder_ / "session.lcm";
    again.session = folder_ / "again.lcm";
    const auto replayed = replay(again);
    ASSERT_TRUE(replayed.ok()) << replayed.error().message;
    EXPECT_EQ(replayed->arrivals_corrected, 0U) << "each decision of the loop has a stamp of its own";
    EXPECT_EQ(replayed->tally.scans_in, live.tally.scans_in);
    EXPECT_EQ(replayed->tally.scans_out, live.tally.scans_out);
    EXPECT_EQ(replayed->tally.scans_degraded, live.tally.scans_degraded);
    EXPECT_EQ(replayed->complete, live.complete);
    EXPECT_EQ(replayed->hash, live.hash) << test::difference(again.log, again.session);
  }

  test::Folder folder_;
  MemoryBusHub hub_;
  std::unique_ptr<Bus> server_bus_, robot_;
  Configuration configuration_;
  ServeOptions options_;
  std::atomic<bool> stop_ = false, started_ = false;
  std::atomic<bool> gate_shut_ = false, at_gate_ = false;
  std::vector<Message> heard_;  ///< MR_SCAN, by await_scan()
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
  expect_same_bytes_again(live);
}

TEST_F(LoopTest, LoopGradesAsItGoesToTheBitAsItsLogIsGradedLater) {
  Configuration lesson = test::configuration({agent("barrel_1", AgentKind::barrel, 1.5, 1)});
  Training& training = lesson.scenario.training.emplace();
  Task drive;
  drive.name = "drive";
  drive.points = 10;
  drive.done.kind = Condition::Kind::speed;
  drive.done.amount = 0.1;
  Task rest;
  rest.name = "never";
  rest.points = 1;
  rest.done.event = EventKind::fell;
  training.tasks = {drive, rest};
  Penalty near;
  near.name = "near";
  near.points = 0.1;
  near.when.kind = Condition::Kind::near;
  near.when.target = "barrel_1";
  near.when.distance = 1.1;
  Penalty touch;
  touch.name = "touch";
  touch.per_impulse = 1.0 / 3;
  touch.when.event = EventKind::collision_continued;
  training.penalties = {near, touch};
  serve_in_background(lesson, seconds(10));
  play(test::drive(3), 1.0);
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  const auto again = grade_session(folder_ / "session.lcm");
  ASSERT_TRUE(again.ok()) << again.error().message;
  ASSERT_TRUE(live.grade.has_value());
  EXPECT_EQ(to_json(*live.grade), to_json(*again));
  EXPECT_FALSE(again->grade.charges.empty());
  EXPECT_TRUE(again->grade.complete) << "stopped by a person";
  std::optional<double> last, ended;
  for (const Message& each : session_log()) {
    Event event;
    if (each.channel != channel::mr_events || !decode("", each.payload, event)) continue;
    if (event.kind == EventKind::score_changed) last = event.value;
    if (event.kind == EventKind::grading_ended) ended = event.value;
  }
  EXPECT_EQ(last, again->grade.score);
  EXPECT_EQ(ended, again->grade.score);
  expect_same_bytes_again(live);
}

TEST_F(LoopTest, LoopThatWasHeldUpReplaysToTheSameBytes) {
  serve_in_background(test::configuration({agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander)}));
  const auto log = test::drive(3);
  const auto third = static_cast<std::ptrdiff_t>(log.size() / 3);
  play({log.begin(), log.begin() + third}, 1.0);
  shut_gate();
  play({log.begin() + third, log.begin() + 2 * third}, 1.0);
  EXPECT_TRUE(await_scan({log.begin(), log.begin() + 2 * third})) << "the guard's";
  open_gate();
  play({log.begin() + 2 * third, log.end()}, 1.0);
  EXPECT_TRUE(await_scan(log));
  stop();
  EXPECT_EQ(heard_.size(), 30U);
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  EXPECT_GT(live.guard_fired, 0U);
  expect_same_bytes_again(live);
}

TEST_F(LoopTest, LoopThatFellBehindAfterStepsOfItsTimerReplaysToTheSameBytes) {
  serve_in_background(test::configuration({agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander)}));
  const auto log = test::drive(1.5);
  const auto middle = log.begin() + static_cast<std::ptrdiff_t>(log.size() / 2);
  play({log.begin(), middle}, 1.0);
  ASSERT_TRUE(await_timer(milliseconds(300))) << "steps that no input was there for";
  shut_gate();
  play({middle, log.end()}, 1.0);
  open_gate();
  EXPECT_TRUE(await_scan(log));
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  expect_same_bytes_again(**report_);
}

TEST_F(LoopTest, LoopWhoseDiskStallsAtAGuardedScanReplaysToTheSameBytes) {
  serve_in_background(test::configuration({agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander)}));
  const auto log = test::drive(1.5);
  const auto last_scan = std::find_if(log.begin() + static_cast<std::ptrdiff_t>(log.size() / 2), log.end(),
                                      [](const Message& each) { return each.channel == channel::scan; });
  play({log.begin(), last_scan}, 1.0);
  shut_gate();
  play({last_scan, last_scan + 1}, 1.0);
  EXPECT_TRUE(await_scan({last_scan, last_scan + 1})) << "the guard's";
  {
    test::StalledDisk disk;
    open_gate();
    EXPECT_TRUE(disk.await_a_write());
    std::this_thread::sleep_for(std::chrono::milliseconds(600));  // that the loop is to lag behind
  }
  play({last_scan + 1, log.end()}, 1.0);
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  EXPECT_GT((*report_)->guard_fired, 0U);
  expect_same_bytes_again(**report_);
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
    if (!accepted) continue;
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

TEST_F(LoopTest, LoopWhoseDiskStallsAnswersEveryScanInOrderAndItsLogIsWholeAfterwards) {
  serve_in_background(test::configuration({agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander)}));
  const auto log = test::drive(4);
  const auto third = static_cast<std::ptrdiff_t>(log.size() / 3);
  play({log.begin(), log.begin() + third}, 1.0);
  {
    test::StalledDisk disk;
    play({log.begin() + third, log.begin() + 2 * third}, 1.0);
    EXPECT_TRUE(disk.await_a_write());
    EXPECT_TRUE(await_scan({log.begin(), log.begin() + 2 * third})) << "the guard's";
  }
  play({log.begin() + 2 * third, log.end()}, 1.0);
  EXPECT_TRUE(await_scan(log));
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  EXPECT_GT(live.guard_fired, 0U);
  EXPECT_TRUE(live.complete) << live.incomplete_because;
  const auto sent = stamps(log, channel::scan);
  EXPECT_EQ(stamps(heard_, channel::mr_scan), sent) << "each once, and in order";
  const auto written = session_log();
  EXPECT_EQ(stamps(written, channel::scan), sent);
  std::vector<Message> answers;
  for (const Message& each : written) {
    if (each.channel == channel::mr_scan) answers.push_back(each);
  }
  ASSERT_EQ(answers.size(), heard_.size());
  for (std::size_t i = 0; i < heard_.size(); ++i) ASSERT_EQ(answers[i].payload, heard_[i].payload) << i;
  expect_same_bytes_again(live);
}

TEST_F(LoopTest, LoopWithTooManyScansWaitingAnswersThemAndSaysWhatItsLogLacks) {
  options_.inbox.bytes = 10'000;  // some ten scans
  serve_in_background(test::configuration({agent("barrel_1", AgentKind::barrel, 0, 0)}));
  const auto log = test::drive(8);
  const auto half = static_cast<std::ptrdiff_t>(log.size() / 2);
  {
    test::StalledDisk disk;
    play({log.begin(), log.begin() + half}, 10.0);
    EXPECT_TRUE(disk.await_a_write());
    EXPECT_TRUE(await_scan({log.begin(), log.begin() + half})) << "the guard's";
  }
  play({log.begin() + half, log.end()}, 1.0);
  EXPECT_TRUE(await_scan(log));
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  EXPECT_EQ(stamps(heard_, channel::mr_scan), stamps(log, channel::scan)) << "each once, and in order";
  EXPECT_EQ(live.tally.scans_in, 80U);
  EXPECT_EQ(live.tally.scans_out, 80U);
  EXPECT_GT(live.tally.scans_left_out, 0U);
  EXPECT_EQ(stamps(session_log(), channel::scan).size() + live.tally.scans_left_out, 80U);
  EXPECT_FALSE(live.complete);
  EXPECT_NE(live.incomplete_because.find(std::to_string(live.tally.scans_left_out) + " scans"),
            std::string::npos)
      << live.incomplete_because;
  expect_same_bytes_again(live);
}

TEST_F(LoopTest, LoopThatIsStoppedAnswersWhatWaits) {
  serve_in_background(test::configuration({agent("barrel_1", AgentKind::barrel, 0, 0)}), seconds(100));
  const auto log = test::drive(2);
  shut_gate();
  for (const Message& each : log) ASSERT_TRUE(robot_->publish(each.channel, each.payload).ok());
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  EXPECT_EQ(live.tally.scans_in, 20U);
  EXPECT_EQ(live.guard_fired, 0U);
  const auto sent = stamps(log, channel::scan);
  EXPECT_EQ(stamps(await(channel::mr_scan, 20), channel::mr_scan), sent);
  EXPECT_EQ(stamps(session_log(), channel::scan), sent);
  expect_same_bytes_again(live);
}

TEST_F(LoopTest, LoopPassesOnAScanThatItCannotReadAndNotWhatIsNoScan) {
  serve_in_background(test::configuration({}));
  std::vector<Message> sent;
  for (int i = 0; i < 20; ++i) {
    Message scan = test::message(channel::scan, 0, test::scan_at(0.1 * i));
    if (i % 2 == 0) scan.payload.resize(scan.payload.size() / 2);
    sent.push_back(scan);
    if (i == 10) shut_gate();  // from here on it is the guard that answers
    ASSERT_TRUE(robot_->publish(scan.channel, scan.payload).ok());
    const Message foreign =
        test::message(channel::scan, 0, Odometry{SensorTime::from_utime(test::start_us), {}});
    ASSERT_TRUE(robot_->publish(foreign.channel, foreign.payload).ok());
  }
  const auto heard = await(channel::mr_scan, 20);
  open_gate();
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  ASSERT_EQ(heard.size(), 20U);
  for (std::size_t i = 0; i < heard.size(); ++i) EXPECT_EQ(heard[i].payload, sent[i].payload) << i;
  EXPECT_EQ(live.tally.scans_in, 20U);
  EXPECT_EQ(live.tally.scans_out, 20U);
  EXPECT_EQ(live.tally.foreign_scans, 20U);
  EXPECT_EQ(live.tally.scans_degraded[static_cast<std::size_t>(Degraded::unreadable)], 10U);
  expect_same_bytes_again(live);
}

TEST_F(LoopTest, ARobotThatWasStoppedWhenTheServerDiedStaysStoppedAndItsLogSaysSo) {
  std::vector<bool> held;
  options_.robot_stopped = true;
  options_.robot_stop_held = [&](bool holds) { held.push_back(holds); };
  serve_in_background(test::configuration({}), seconds(10));
  const auto say = [&](const std::string& channel, const auto& item) {
    const Message message = test::message(channel, 0, item);
    ASSERT_TRUE(robot_->publish(message.channel, message.payload).ok());
  };
  say(channel::teleop, TwistCommand{{wall_now().ns}, {0, 0, 0.3}});
  const auto next_event = [&] {
    Event event;
    EXPECT_TRUE(decode("", await(channel::mr_events, 1).at(0).payload, event).ok());
    return event;
  };
  Event event = next_event();
  while (event.kind != EventKind::command_reduced) event = next_event();
  EXPECT_EQ(event.text, "emergency_stop");
  say(channel::teleop, TwistCommand{{wall_now().ns}, {}});
  AgentCommand release;
  release.request = 9;
  release.action = AgentCommand::Action::unfreeze;
  release.agent.name = configuration_.robot.name;
  say(channel::mr_agent_cmd, release);
  while (event.request != 9) event = next_event();
  EXPECT_EQ(event.kind, EventKind::command_accepted);
  stop();
  EXPECT_EQ(held, (std::vector<bool>{true, false}));
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  expect_same_bytes_again(**report_);
}

TEST_F(LoopTest, APausedSessionStandsStillAnswersAndReplaysToTheSameBytes) {
  const auto clock = std::make_shared<SessionClock>();
  options_.clock = clock;
  serve_in_background(test::level_1());
  ASSERT_EQ(await(channel::mr_world, 3).size(), 3U);
  clock->set_rate(0);
  const auto answered = [&](std::uint64_t request) {
    AgentCommand command;
    command.action = AgentCommand::Action::freeze;
    command.request = request;
    command.stamp = {wall_now().ns};
    std::vector<std::uint8_t> payload;
    encode(command, payload);
    EXPECT_TRUE(robot_->publish(channel::mr_agent_cmd, payload).ok());
    Event event;
    while (event.request != request) {
      const auto heard = await(channel::mr_events, 1);
      if (heard.empty() || !decode(heard[0].channel, heard[0].payload, event).ok()) break;
    }
    EXPECT_EQ(event.request, request);
    return event.stamp;
  };
  const SimulationTime before = answered(1);
  ASSERT_EQ(await(channel::mr_status, 2).size(), 2U);  // more than a second of real time
  EXPECT_LT(answered(2) - before, milliseconds(1));
  clock->set_rate(1);
  ASSERT_EQ(await(channel::mr_world, 3).size(), 3U);
  stop();
  ASSERT_TRUE(report_ && report_->ok());
  expect_same_bytes_again(**report_);
}

}  // namespace
}  // namespace parhelion
