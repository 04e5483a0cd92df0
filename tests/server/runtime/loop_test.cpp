// The live server over a memory bus: every scan has a result, and its session log replays to the same bytes.
#include "server/tick/foreign_publisher.hpp"
#include "tests/server/runtime/loop_fixture.hpp"
#include "tests/server/tick/level_1.hpp"

namespace parhelion::runtime {
namespace {

using test::agent;
using test::LoopTest;

TEST_F(LoopTest, LoopPublishesEveryScanAndReplaysToTheSameBytes) {
  serve_in_background(test::configuration({agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander),
                                           agent("barrel_1", AgentKind::barrel, 0, 0)}),
                      seconds(10));
  const auto log = test::drive(2);
  play(log, 1.0);
  EXPECT_EQ(await(channel::kMrScan, 20).size(), 20U);
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  EXPECT_EQ(live.tally.scans_in, 20U);
  EXPECT_GT(live.tally.beams_replaced, 0U);
  expect_same_bytes_again(live);
}

TEST_F(LoopTest, LoopGradingEqualsLaterGradingOfItsLog) {
  tick::Configuration lesson = test::configuration({agent("barrel_1", AgentKind::barrel, 1.5, 1)});
  Training& training = lesson.scenario.training.emplace();
  training.on_command = false;
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
  touch.when.event = EventKind::contact_continues;
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
  EXPECT_FALSE(again->grade.deductions.empty());
  EXPECT_TRUE(again->grade.complete) << "stopped by a person";
  std::optional<double> last, ended;
  for (const Message& each : session_log()) {
    Event event;
    if (each.channel != channel::kMrEvents || !decode("", each.payload, event)) continue;
    if (event.kind == EventKind::score_changed) last = event.value;
    if (event.kind == EventKind::grading_ended) ended = event.value;
  }
  EXPECT_EQ(last, again->grade.score);
  EXPECT_EQ(ended, again->grade.score);
  expect_same_bytes_again(live);
}

TEST_F(LoopTest, LoopAcknowledgesACommandOnlyAfterItIsInTheLog) {
  serve_in_background(test::configuration({}));
  const AgentSpawn command{
      .stamp = {wall_now().ns}, .request = 99, .agent = agent("box_1", AgentKind::box, 3, 2)};
  const Message message = test::message(channel::kMrSpawn, 0, command);
  ASSERT_TRUE(robot_->publish(message.channel, message.payload).ok());
  bool accepted = false;
  while (!accepted) {
    const auto events = await(channel::kMrEvents, 1);
    ASSERT_EQ(events.size(), 1U);
    Event event;
    ASSERT_TRUE(decode(events[0].channel, events[0].payload, event).ok());
    accepted = event.request == 99 && event.kind == EventKind::command_accepted;
    if (!accepted) continue;
    // The server is still running: a kill would leave the current file.
    auto reader = LogReader::open(folder_ / "session.lcm");
    ASSERT_TRUE(reader.ok());
    bool found = false;
    while (true) {
      const auto next = reader->next();
      if (!next.ok() || !*next) break;
      found = found || ((*next)->channel == channel::kMrSpawn && (*next)->payload == message.payload);
    }
    EXPECT_TRUE(found);
  }
}

TEST_F(LoopTest, ALoopThatHangsDoesNotReportThatItRuns) {
  std::atomic<int> rounds = 0;
  std::atomic<bool> ended = false;
  options_.loop_runs = [&] { ++rounds; };
  options_.loop_ended = [&] { ended = true; };
  serve_in_background(test::configuration({}));
  ASSERT_EQ(await(channel::kMrStatus, 1).size(), 1U);
  shut_gate();
  const int before = rounds;
  EXPECT_GT(before, 0);
  // The guard has threads of its own, and answers in spite of the loop.
  for (int sequence = 1; sequence <= 3; ++sequence) {
    const Message scan = test::message(channel::kScan, 0, test::scan_at(sequence));
    ASSERT_TRUE(robot_->publish(scan.channel, scan.payload).ok());
  }
  ASSERT_EQ(await(channel::kMrScan, 3).size(), 3U);
  EXPECT_EQ(rounds, before);
  open_gate();
  ASSERT_EQ(await(channel::kMrStatus, 2).size(), 2U);
  EXPECT_GT(rounds, before);
  EXPECT_FALSE(ended);
  stop();
  EXPECT_TRUE(ended);
}

TEST_F(LoopTest, StoppingTheLoopPublishesQueuedScans) {
  serve_in_background(test::configuration({agent("barrel_1", AgentKind::barrel, 0, 0)}), seconds(100));
  const auto log = test::drive(2);
  shut_gate();
  for (const Message& each : log) ASSERT_TRUE(robot_->publish(each.channel, each.payload).ok());
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  EXPECT_EQ(live.tally.scans_in, 20U);
  EXPECT_EQ(live.guard_fired, 0U);
  const auto sent = stamps(log, channel::kScan);
  EXPECT_EQ(stamps(await(channel::kMrScan, 20), channel::kMrScan), sent);
  EXPECT_EQ(stamps(session_log(), channel::kScan), sent);
  expect_same_bytes_again(live);
}

TEST_F(LoopTest, LoopForwardsUnreadableScansButNotOtherMessages) {
  serve_in_background(test::configuration({}));
  std::vector<Message> sent;
  for (int i = 0; i < 20; ++i) {
    Message scan = test::message(channel::kScan, 0, test::scan_at(0.1 * i));
    if (i % 2 == 0) std::fill(scan.payload.end() - 4, scan.payload.end(), std::uint8_t{0});  // radstep
    sent.push_back(scan);
    if (i == 10) shut_gate();  // from here on the guard publishes
    ASSERT_TRUE(robot_->publish(scan.channel, scan.payload).ok());
    Message foreign = test::message(channel::kScan, 0, Odometry{SensorTime::from_utime(test::kStartUs), {}});
    // Another type, or not as long as it declares: what else would be in it?
    if (i % 4 == 0) foreign.payload.assign(scan.payload.begin(), scan.payload.end() - 1);
    ASSERT_TRUE(robot_->publish(foreign.channel, foreign.payload).ok());
  }
  const auto messages = await(channel::kMrScan, 20);
  open_gate();
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  ASSERT_EQ(messages.size(), 20U);
  for (std::size_t i = 0; i < messages.size(); ++i) EXPECT_EQ(messages[i].payload, sent[i].payload) << i;
  EXPECT_EQ(live.tally.scans_in, 20U);
  EXPECT_EQ(live.tally.scans_out, 20U);
  EXPECT_EQ(live.tally.foreign_scans, 20U);
  EXPECT_EQ(live.tally.scans_degraded[static_cast<std::size_t>(tick::Degraded::unreadable)], 10U);
  expect_same_bytes_again(live);
}

TEST_F(LoopTest, ReportsAnotherServerOnceAndNotItself) {
  serve_in_background(test::configuration({}));
  const auto await_own_status = [&](int times) {
    ServerStatus status;
    for (; times > 0; times -= status.values.size() > 1) {
      const auto messages = await(channel::kMrStatus, 1);
      ASSERT_EQ(messages.size(), 1U);
      ASSERT_TRUE(decode(channel::kMrStatus, messages[0].payload, status).ok());
    }
  };
  await_own_status(2);
  for (int i = 0; i < 5; ++i) {
    const Message another =
        test::message(channel::kMrStatus, 0, ServerStatus{{wall_now().ns}, {{"i", i}}, {}});
    ASSERT_TRUE(robot_->publish(another.channel, another.payload).ok());
    await_own_status(i == 0 ? 2 : 0);
  }
  await_own_status(1);
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  EXPECT_EQ(std::count(notices_.begin(), notices_.end(), tick::kOtherServerText), 1);
  std::vector<std::string> foreign_publishers;
  for (const Message& each : session_log()) {
    Event event;
    if (each.channel != channel::kMrEvents || !decode("", each.payload, event)) continue;
    if (event.kind == EventKind::foreign_publisher)
      foreign_publishers.push_back(event.object + ": " + event.text);
  }
  EXPECT_EQ(foreign_publishers,
            std::vector<std::string>{std::string("MR_STATUS: ") + tick::kOtherServerText});
  expect_same_bytes_again(**report_);
}

TEST_F(LoopTest, AStoppedRobotStaysStoppedAfterARestartAndIsLogged) {
  std::vector<bool> held;
  options_.stopped_robots = {test::robot().name};
  options_.robot_stop_held = [&](const std::string&, bool holds) { held.push_back(holds); };
  serve_in_background(test::configuration({}), seconds(10));
  const auto publish_item = [&](const std::string& channel, const auto& item) {
    const Message message = test::message(channel, 0, item);
    ASSERT_TRUE(robot_->publish(message.channel, message.payload).ok());
  };
  publish_item(channel::kTeleop, TwistCommand{{wall_now().ns}, {0, 0, 0.3}});
  const auto next_event = [&] {
    Event event;
    EXPECT_TRUE(decode("", await(channel::kMrEvents, 1).at(0).payload, event).ok());
    return event;
  };
  Event event = next_event();
  while (event.kind != EventKind::speed_limited) event = next_event();
  EXPECT_EQ(event.text, "emergency_stop");
  publish_item(channel::kTeleop, TwistCommand{{wall_now().ns}, {}});
  publish_item(channel::kMrEmergencyStop,
               EmergencyStopCommand{.request = 9, .robot = configuration_.robot.name, .engaged = false});
  while (event.request != 9) event = next_event();
  EXPECT_EQ(event.kind, EventKind::command_accepted);
  stop();
  EXPECT_EQ(held, (std::vector<bool>{true, false}));
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  expect_same_bytes_again(**report_);
}

TEST_F(LoopTest, APausedSessionPublishesScansAndReplaysIdentically) {
  const auto clock = std::make_shared<SessionClock>();
  options_.clock = clock;
  serve_in_background(test::level_1());
  ASSERT_EQ(await(channel::kMrWorld, 3).size(), 3U);
  clock->set_rate(0);
  const auto answered = [&](std::uint64_t request) {
    std::vector<std::uint8_t> payload;
    encode(AgentFreeze{.stamp = {wall_now().ns}, .request = request, .all = true}, payload);
    EXPECT_TRUE(robot_->publish(channel::kMrFreeze, payload).ok());
    Event event;
    while (event.request != request) {
      const auto messages = await(channel::kMrEvents, 1);
      if (messages.empty() || !decode(messages[0].channel, messages[0].payload, event).ok()) break;
    }
    EXPECT_EQ(event.request, request);
    return event.stamp;
  };
  const SimulationTime before = answered(1);
  ASSERT_EQ(await(channel::kMrStatus, 2).size(), 2U);  // more than a second of real time
  EXPECT_LT(answered(2) - before, milliseconds(1));
  clock->set_rate(1);
  ASSERT_EQ(await(channel::kMrWorld, 3).size(), 3U);
  stop();
  ASSERT_TRUE(report_ && report_->ok());
  expect_same_bytes_again(**report_);
}

}  // namespace
}  // namespace parhelion::runtime
