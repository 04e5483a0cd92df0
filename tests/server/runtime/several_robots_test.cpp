// Several real robots in one session: replay, the live server, and the queues of its inbox.
#include "tests/server/tick/several_robots.hpp"

#include <gtest/gtest.h>

#include "tests/server/runtime/loop_fixture.hpp"
#include "tests/server/runtime/replay_fixture.hpp"

namespace parhelion::runtime {
namespace {

using namespace test;

constexpr int kRobots = 4;

std::string robot_name(int i) { return "rover_" + std::to_string(i + 1); }

/// Four robots: one on its circle, three that stand.
std::vector<Message> four_robots_drive(double duration) {
  std::vector<Message> log = of_robot(drive(duration), robot_name(0));
  for (int i = 1; i < kRobots; ++i) {
    const auto place = Transform<Map, Base>::planar(-4 + 2.0 * i, 3, -1.5);
    log = by_arrival(log, of_robot(standing(duration, place, [&](double t) { return seen_from(place, t); }),
                                   robot_name(i)));
  }
  return log;
}

Scenario four_robots(const TemporaryFolder& folder) {
  Scenario scenario;
  scenario.name = "four robots";
  scenario.model = folder / "model.yaml";
  for (int i = 0; i < kRobots; ++i) scenario.robots.push_back({robot_name(i), folder / "robot.yaml"});
  scenario.agents = {agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander),
                     agent("person_1", AgentKind::person, -3, 1, BehaviourKind::wander),
                     agent("barrel_1", AgentKind::barrel, 0, 0)};
  scenario.agents[0].laser = "lms-200";
  return scenario;
}

class SeveralRobotsReplayTest : public ReplayFixture {
 protected:
  void SetUp() override { write(four_robots(folder_), robot(), four_robots_drive(3)); }
};

TEST_F(SeveralRobotsReplayTest, TheBytesAreTheSameForAnyThreadCount) {
  const Report first = run(options("a.lcm"));
  for (int i = 0; i < kRobots; ++i)
    EXPECT_TRUE(first.hash.contains(robot_channel(channel::kMrScan, robot_name(i)))) << i;
  EXPECT_EQ(first.tally.scans_in, kRobots * 30U);
  EXPECT_GT(first.tally.beams_replaced, 0U);
  expect_same_bytes_for_any_thread_count(first);
}

TEST_F(SeveralRobotsReplayTest, ASessionReplaysWithoutItsFiles) {
  expect_replay_without_files(run(options("a.lcm")));
}

TEST_F(SeveralRobotsReplayTest, TheReportHasTheFiguresOfEachRobot) {
  const Report report = run(options("a.lcm"));
  ASSERT_EQ(report.robots.size(), std::size_t{kRobots});
  for (const RobotReport& each : report.robots) {
    EXPECT_EQ(each.scans_in, 30U) << each.name;
    EXPECT_EQ(each.scan_us.count(), 30U) << each.name;
  }
}

TEST_F(SeveralRobotsReplayTest, ADescriptionThatIsNowhereIsNamed) {
  Scenario scenario = four_robots(folder_);
  scenario.robots[2].description.clear();
  std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
  auto log = four_robots_drive(1);
  std::erase_if(log, [](const Message& each) { return each.channel.starts_with("ROBOT"); });
  write_log(folder_ / "drive.lcm", log);
  const auto report = replay(options("a.lcm"));
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.error().message.find("no ROBOT.rover_3 message; give robot 'rover_3' a 'description'"),
            std::string::npos)
      << report.error().message;
}

class SeveralRobotsLoopTest : public LoopTest {
 protected:
  tick::Configuration two() {
    return two_robots_configuration(two_robots({agent("b", AgentKind::barrel, 0, 0)}));
  }
  /// Receives MR_SCAN of both robots until each has `count`.
  std::map<std::string, std::size_t> await_scans(std::size_t count) {
    std::map<std::string, std::size_t> received;
    const std::string one = robot_channel(channel::kMrScan, kRover1),
                      other = robot_channel(channel::kMrScan, kRover2);
    Message message;
    while (received[one] < count || received[other] < count) {
      const auto came = robot_->receive(message, seconds(20));
      if (!came.ok() || !*came) break;
      if (message.channel == one || message.channel == other) ++received[message.channel];
    }
    return received;
  }
};

TEST_F(SeveralRobotsLoopTest, EachScanIsAnsweredOnceAndTheSessionReplaysIdentically) {
  serve_in_background(two());
  const auto log = two_robots_drive(2);
  play(log, 4);
  const auto received = await_scans(20);
  stop();
  for (const auto& [name, count] : received) EXPECT_EQ(count, 20U) << name;
  ASSERT_TRUE(report_->ok());
  expect_same_bytes_again(**report_);
}

/// While the loop hangs, the guards of both robots publish the raw scans.
TEST_F(SeveralRobotsLoopTest, EachRobotHasAGuard) {
  serve_in_background(two());
  shut_gate();
  for (const std::string& robot : {kRover1, kRover2}) {
    const Message scan = message(robot_channel(channel::kScan, robot), kStartUs, scan_at(0));
    ASSERT_TRUE(robot_->publish(scan.channel, scan.payload).ok());
  }
  const auto received = await_scans(1);
  EXPECT_EQ(received.size(), 2U);
  open_gate();
  stop();
  ASSERT_TRUE(report_->ok());
  ASSERT_EQ((*report_)->robots.size(), 2U);
  for (const RobotReport& each : (*report_)->robots) EXPECT_EQ(each.guard_fired, 1U) << each.name;
  expect_same_bytes_again(**report_);
}

TEST_F(SeveralRobotsLoopTest, AStopOfOneRobotOutlivesTheServerForThatRobotAlone) {
  std::vector<std::string> held;
  options_.stopped_robots = {kRover2};
  options_.robot_stop_held = [&](const std::string& robot, bool holds) {
    held.push_back(robot + (holds ? " stopped" : " released"));
  };
  serve_in_background(two(), seconds(10));
  const Message release = message(channel::kMrEmergencyStop, 0,
                                  EmergencyStopCommand{.request = 9, .robot = "", .engaged = false});
  ASSERT_TRUE(robot_->publish(release.channel, release.payload).ok());
  Event event;
  while (event.request != 9) {
    const auto came = await(channel::kMrEvents, 1);
    ASSERT_FALSE(came.empty());
    ASSERT_TRUE(decode("", came.front().payload, event).ok());
  }
  stop();
  EXPECT_EQ(held, (std::vector<std::string>{kRover2 + " stopped", kRover2 + " released"}));
}

/// A second server on this bus is reported once, as with one robot.
TEST_F(SeveralRobotsLoopTest, AnotherPublisherOnARobotsOutputsIsNamed) {
  serve_in_background(two());
  const Message foreign = message(robot_channel(channel::kMrCmd, kRover2), 0, TwistCommand{{1}, {0.5, 0, 0}});
  ASSERT_TRUE(robot_->publish(foreign.channel, foreign.payload).ok());
  Event event;
  while (event.kind != EventKind::foreign_publisher) {
    const auto came = await(channel::kMrEvents, 1);
    ASSERT_FALSE(came.empty());
    ASSERT_TRUE(decode("", came.front().payload, event).ok());
  }
  EXPECT_EQ(event.subject, kRover2);
  EXPECT_EQ(event.object, "MR_CMD.rover_2");
}

/// Of a robot that sends far too much, no more than every second input is taken while the other waits.
TEST(SeveralRobotsInbox, ARobotThatFloodsDelaysItself) {
  MemoryBusHub hub;
  const auto server = hub.connect(), robots = hub.connect();
  ASSERT_TRUE(server->subscribe("SCAN\\..*", 10'000).ok());
  tick::Configuration configuration;
  configuration.channels = tick::ChannelMap(two_robots());
  Guard one(seconds(60), [](auto) {}), other(seconds(60), [](auto) {});
  Inbox inbox(*server, configuration, {{&one}, {&other}});
  const Message flood = message(robot_channel(channel::kScan, kRover1), 0, scan_at(0));
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(robots->publish(flood.channel, flood.payload).ok());
  for (int i = 0; i < 5; ++i)
    ASSERT_TRUE(robots->publish(robot_channel(channel::kScan, kRover2), flood.payload).ok());
  inbox.close();  // everything is in its queues
  int position = 0, taken = 0;
  while (taken < 5) {
    const auto next = inbox.take(steady_now());
    ASSERT_TRUE(next.has_value());
    ++position;
    taken += next->robot == 1;
  }
  EXPECT_LE(position, 10);
}

}  // namespace
}  // namespace parhelion::runtime
