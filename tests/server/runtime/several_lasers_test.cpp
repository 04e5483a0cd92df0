// Several planar lasers of one robot: replay, and the live server with a guard for each laser.
#include "tests/server/tick/several_lasers.hpp"

#include <gmock/gmock.h>

#include "tests/server/runtime/loop_fixture.hpp"
#include "tests/server/runtime/replay_fixture.hpp"

namespace parhelion::runtime {
namespace {

using namespace test;

const std::vector<AgentDefinition> kAgents{
    agent("barrel_1", AgentKind::barrel, 0, 0),
    agent("person_1", AgentKind::person, -3, 1, BehaviourKind::wander)};

class SeveralLasersReplayTest : public ReplayFixture {
 protected:
  void SetUp() override {
    Scenario scenario;
    scenario.name = "two lasers";
    scenario.model = folder_ / "model.yaml";
    scenario.robot = folder_ / "robot.yaml";
    scenario.agents = kAgents;
    scenario.agents.push_back(agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander));
    scenario.agents.back().laser = "lms-200";
    write(scenario, robot_with_two_lasers(), two_lasers_drive(3));
  }
};

TEST_F(SeveralLasersReplayTest, TheBytesAreTheSameForAnyThreadCount) {
  const Report first = run(options("a.lcm"));
  EXPECT_TRUE(first.hash.contains(channel::kMrScan));
  EXPECT_TRUE(first.hash.contains(kMrRearScan));
  EXPECT_GT(first.tally.beams_replaced, 0U);
  expect_same_bytes_for_any_thread_count(first);
}

TEST_F(SeveralLasersReplayTest, ASessionReplaysWithoutItsFiles) {
  expect_replay_without_files(run(options("a.lcm")));
}

TEST_F(SeveralLasersReplayTest, ReportAndStatusHaveTheCountsOfEachFurtherLaser) {
  const Report report = run(options("a.lcm"));
  ASSERT_EQ(report.lasers.size(), 1U);
  EXPECT_EQ(report.lasers[0].name, kRear);
  EXPECT_EQ(report.lasers[0].scans_in, 37U) << "every 80 ms from 47 ms on";
  EXPECT_EQ(report.tally.scans_in, 30U + 37U);
  std::map<std::string, double> values;
  for (const auto& [key, value] : to_status(report, {}).values) values[key] = value;
  EXPECT_EQ(values.at("scans_in"), 67);
  EXPECT_EQ(values.at("scans_in_rear"), 37);
  EXPECT_EQ(values.at("scans_degraded_rear"), static_cast<double>(report.lasers[0].scans_degraded));
  EXPECT_THAT(to_json(report), testing::HasSubstr("\"rear\""));
}

class SeveralLasersLoopTest : public LoopTest {
 protected:
  /// Receives MR_SCAN of both lasers until each has its count.
  std::map<std::string, std::vector<Message>> await_scans(std::size_t front, std::size_t rear) {
    std::map<std::string, std::vector<Message>> received;
    Message message;
    while (received[channel::kMrScan].size() < front || received[kMrRearScan].size() < rear) {
      const auto came = robot_->receive(message, seconds(20));
      if (!came.ok() || !*came) break;
      if (message.channel == channel::kMrScan || message.channel == kMrRearScan)
        received[message.channel].push_back(message);
    }
    return received;
  }
};

TEST_F(SeveralLasersLoopTest, EachScanIsAnsweredOnceInOrderAndTheSessionReplaysIdentically) {
  serve_in_background(two_lasers_configuration(kAgents));
  const auto log = two_lasers_drive(2);
  play(log, 4);
  const auto front = stamps(log, channel::kScan), rear = stamps(log, kRearScan);
  const auto received = await_scans(front.size(), rear.size());
  stop();
  EXPECT_EQ(stamps(received.at(channel::kMrScan), channel::kMrScan), front);
  EXPECT_EQ(stamps(received.at(kMrRearScan), kMrRearScan), rear);
  ASSERT_TRUE(report_->ok());
  expect_same_bytes_again(**report_);
}

/// While the loop hangs, the guard of each laser publishes its raw scans.
TEST_F(SeveralLasersLoopTest, EachLaserHasAGuard) {
  serve_in_background(two_lasers_configuration(kAgents));
  shut_gate();
  const RobotDescription robot = robot_with_two_lasers();
  const Message front = message(channel::kScan, kStartUs, cast_on_circle(robot.laser_at(0), 0));
  const Message rear = message(kRearScan, kStartUs, cast_on_circle(robot.laser_at(1), 0));
  for (const Message& each : {front, rear, rear})
    ASSERT_TRUE(robot_->publish(each.channel, each.payload).ok());
  const auto received = await_scans(1, 2);
  EXPECT_EQ(received.at(channel::kMrScan).at(0).payload, front.payload);
  EXPECT_EQ(received.at(kMrRearScan).at(1).payload, rear.payload);
  open_gate();
  stop();
  ASSERT_TRUE(report_->ok());
  EXPECT_EQ((*report_)->guard_fired, 3U);
  ASSERT_EQ((*report_)->lasers.size(), 1U);
  EXPECT_EQ((*report_)->lasers[0].guard_fired, 2U);
  expect_same_bytes_again(**report_);
}

TEST_F(SeveralLasersLoopTest, AnotherPublisherOnALasersAnswersIsNamed) {
  serve_in_background(two_lasers_configuration(kAgents));
  const Message foreign = message(kMrRearScan, 0, scan_at(0));
  ASSERT_TRUE(robot_->publish(foreign.channel, foreign.payload).ok());
  Event event;
  while (event.kind != EventKind::foreign_publisher) {
    const auto came = await(channel::kMrEvents, 1);
    ASSERT_FALSE(came.empty());
    ASSERT_TRUE(decode("", came.front().payload, event).ok());
  }
  EXPECT_EQ(event.object, kMrRearScan);
  EXPECT_THAT(event.text, testing::HasSubstr("only this server may publish"));
}

}  // namespace
}  // namespace parhelion::runtime
