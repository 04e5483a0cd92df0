// Delays of the live server: by its own thread, its timer, its disk. The guard publishes meanwhile, the log
// records it, and replays to the same bytes.
#include <algorithm>
#include <map>
#include <set>

#include "tests/server/runtime/loop_fixture.hpp"
#include "tests/slow_disk.hpp"

namespace parhelion::runtime {
namespace {

using test::agent;

class LoopDelayTest : public test::LoopTest {
 protected:
  static std::vector<Message>::const_iterator last_scan(const std::vector<Message>& log) {
    const auto found = std::find_if(log.rbegin(), log.rend(),
                                    [](const Message& each) { return each.channel == channel::kScan; });
    return std::prev(found.base());
  }
};

TEST_F(LoopDelayTest, DelayedLoopReplaysToTheSameBytes) {
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
  EXPECT_EQ(received_.size(), 30U);
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  EXPECT_GT(live.guard_fired, 0U);
  expect_same_bytes_again(live);
}

TEST_F(LoopDelayTest, LoopBehindAfterTimerStepsReplaysToTheSameBytes) {
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

/// The command is refused, and no later input waits for all the steps that are late by then.
TEST_F(LoopDelayTest, LoopBehindWithAStaleCommandSkipsStepsBeforeIt) {
  serve_in_background(test::configuration({agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander)}));
  const auto log = test::drive(1.5);
  play(log, 1.0);
  EXPECT_TRUE(await_scan(log));
  shut_gate();
  std::vector<std::uint8_t> payload;
  encode(TwistCommand{{runtime::wall_now().ns}, {0.2, 0, 0}}, payload);
  ASSERT_TRUE(robot_->publish(channel::kTeleop, payload).ok());
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));  // delay of the loop
  open_gate();
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  std::int64_t stale = 0, skipped_before = 0;
  for (const Message& each : session_log()) {
    LoopDecision decision;
    if (each.channel != channel::kLoop || !decode(each.channel, each.payload, decision)) continue;
    stale += decision.kind == LoopDecision::Kind::stale_command;
    if (decision.kind == LoopDecision::Kind::steps_skipped && stale == 0) skipped_before += decision.count;
  }
  EXPECT_EQ(stale, 1);
  EXPECT_GT(skipped_before, 100) << "of 240 that a second has";
  expect_same_bytes_again(**report_);
}

/// To this many requests, in the order in which they come; fewer if they do not.
std::vector<Event> first_replies(Bus& bus, std::size_t count) {
  std::vector<Event> replies;
  std::set<std::uint64_t> requests;
  Message message;
  while (replies.size() < count) {
    const auto received = bus.receive(message, seconds(20));
    if (!received || !*received) return replies;
    Event event;
    if (message.channel != channel::kMrEvents || !decode(message.channel, message.payload, event)) continue;
    const bool is_reply =
        event.kind == EventKind::command_accepted || event.kind == EventKind::command_refused;
    if (is_reply && event.request != 0 && requests.insert(event.request).second)
      replies.push_back(std::move(event));
  }
  return replies;
}

/// Each sender gets a reply, no agent appears late, and the stop that came last is executed.
TEST_F(LoopDelayTest, LoopThatIsBehindRefusesCommandsAndStillStopsTheRobot) {
  options_.inbox.commands = 5;
  serve_in_background(test::configuration({agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander)}));
  const auto log = test::drive(1.5);
  const auto last = last_scan(log);
  play({log.begin(), last}, 1.0);
  EXPECT_TRUE(await_scan({log.begin(), last}));
  shut_gate();
  constexpr std::uint64_t kSent = 12;
  std::vector<std::uint8_t> payload;
  for (std::uint64_t i = 1; i <= kSent; ++i) {
    AgentSpawn spawn;
    spawn.request = i;
    spawn.agent = agent("box_" + std::to_string(i), AgentKind::box, 10.0 + static_cast<double>(i), 10);
    encode(spawn, payload);
    ASSERT_TRUE(robot_->publish(channel::kMrSpawn, payload).ok());
  }
  EmergencyStopCommand engage;
  engage.request = kSent + 1;
  encode(engage, payload);
  ASSERT_TRUE(robot_->publish(channel::kMrEmergencyStop, payload).ok());
  play({last, last + 1}, 1.0);
  EXPECT_TRUE(await_scan({last, last + 1})) << "the guard's: the inbox has received what was sent before";
  open_gate();
  const std::vector<Event> replied = first_replies(*robot_, kSent + 1);
  ASSERT_EQ(replied.size(), kSent + 1);
  stop();
  std::map<std::uint64_t, Event> replies;
  for (const Event& reply : replied) replies.emplace(reply.request, reply);
  const auto is_of_stop = [](const Event& reply) { return reply.request == kSent + 1; };
  EXPECT_LE(std::find_if(replied.begin(), replied.end(), is_of_stop) - replied.begin(), 8)
      << "the stop, behind the command in work and the refusals";
  EXPECT_EQ(replies[kSent + 1].kind, EventKind::command_accepted);
  for (std::uint64_t i = 1; i <= kSent; ++i) {
    const bool refused = i > 5;
    EXPECT_EQ(replies[i].kind, refused ? EventKind::command_refused : EventKind::command_accepted) << i;
    EXPECT_EQ(replies[i].text.find("cannot keep up") != std::string::npos, refused) << replies[i].text;
  }
  expect_same_bytes_again(**report_);
}

/// A client that floods has its own commands refused, and no other's.
TEST_F(LoopDelayTest, LoopThatIsBehindExecutesTheCommandOfAnotherClientThanTheOneThatFloods) {
  options_.inbox.commands = 5;
  serve_in_background(test::configuration({agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander)}));
  const auto log = test::drive(1.5);
  const auto last = last_scan(log);
  play({log.begin(), last}, 1.0);
  EXPECT_TRUE(await_scan({log.begin(), last}));
  shut_gate();
  constexpr std::uint64_t kSent = 12, kOther = 100;
  std::vector<std::uint8_t> payload;
  for (std::uint64_t i = 1; i <= kSent; ++i) {
    AgentSpawn spawn;
    spawn.request = i;
    spawn.agent = agent("box_" + std::to_string(i), AgentKind::box, 10.0 + static_cast<double>(i), 10);
    encode(spawn, payload);
    ASSERT_TRUE(robot_->publish(channel::kMrSpawn, payload).ok());
  }
  const auto instructor = hub_.connect();
  AgentRemove remove;
  remove.request = kOther;
  remove.all = true;
  encode(remove, payload);
  ASSERT_TRUE(instructor->publish(channel::kMrRemove, payload).ok());
  play({last, last + 1}, 1.0);
  EXPECT_TRUE(await_scan({last, last + 1})) << "the guard's: the inbox has received what was sent before";
  open_gate();
  const std::vector<Event> replies = first_replies(*robot_, kSent + 1);
  ASSERT_EQ(replies.size(), kSent + 1);
  stop();
  std::size_t accepted = 0;
  for (const Event& reply : replies) {
    if (reply.kind == EventKind::command_accepted) ++accepted;
    EXPECT_TRUE(reply.request != kOther || reply.kind == EventKind::command_accepted);
  }
  EXPECT_EQ(accepted, 5U);
  expect_same_bytes_again(**report_);
}

TEST_F(LoopDelayTest, LoopWithADiskStallAtAGuardedScanReplaysIdentically) {
  serve_in_background(test::configuration({agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander)}));
  const auto log = test::drive(1.5);
  const auto last_scan = std::find_if(log.begin() + static_cast<std::ptrdiff_t>(log.size() / 2), log.end(),
                                      [](const Message& each) { return each.channel == channel::kScan; });
  play({log.begin(), last_scan}, 1.0);
  shut_gate();
  play({last_scan, last_scan + 1}, 1.0);
  EXPECT_TRUE(await_scan({last_scan, last_scan + 1})) << "the guard's";
  {
    test::StalledDisk disk;
    open_gate();
    EXPECT_TRUE(disk.await_a_write());
    std::this_thread::sleep_for(std::chrono::milliseconds(600));  // delay of the loop
  }
  play({last_scan + 1, log.end()}, 1.0);
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  EXPECT_GT((*report_)->guard_fired, 0U);
  expect_same_bytes_again(**report_);
}

TEST_F(LoopDelayTest, LoopWithADiskStallPublishesAndLogsEveryScanInOrder) {
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
  const auto sent = stamps(log, channel::kScan);
  EXPECT_EQ(stamps(received_, channel::kMrScan), sent) << "each once, and in order";
  const auto written = session_log();
  EXPECT_EQ(stamps(written, channel::kScan), sent);
  std::vector<Message> answers;
  for (const Message& each : written) {
    if (each.channel == channel::kMrScan) answers.push_back(each);
  }
  ASSERT_EQ(answers.size(), received_.size());
  for (std::size_t i = 0; i < received_.size(); ++i) ASSERT_EQ(answers[i].payload, received_[i].payload) << i;
  expect_same_bytes_again(live);
}

TEST_F(LoopDelayTest, LoopPublishesTooManyQueuedScansAndReportsLogGaps) {
  options_.inbox.bytes = 10'000;  // about ten scans
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
  EXPECT_EQ(stamps(received_, channel::kMrScan), stamps(log, channel::kScan)) << "each once, and in order";
  EXPECT_EQ(live.tally.scans_in, 80U);
  EXPECT_EQ(live.tally.scans_out, 80U);
  EXPECT_GT(live.tally.scans_left_out, 0U);
  EXPECT_EQ(stamps(session_log(), channel::kScan).size() + live.tally.scans_left_out, 80U);
  EXPECT_FALSE(live.complete);
  EXPECT_NE(live.incomplete_because.find(std::to_string(live.tally.scans_left_out) + " scans"),
            std::string::npos)
      << live.incomplete_because;
  expect_same_bytes_again(live);
}

}  // namespace
}  // namespace parhelion::runtime
