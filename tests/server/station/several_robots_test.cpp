// Pages of a session with several trainees' robots: each page follows one, and all see the list of all.
#include "tests/server/tick/several_robots.hpp"

#include <gtest/gtest.h>

#include "protocols/channel_map.hpp"
#include "server/station/console/operator_console.hpp"
#include "tests/server/station/feed_fixture.hpp"
#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

using test::kRover1, test::kRover2;

class SeveralRobotsFeedTest : public test::FeedTest {
 protected:
  SeveralRobotsFeedTest() {
    Scenario scenario = test::two_robots();
    Task task;
    task.name = "drive";
    task.points = 10;
    task.done.kind = Condition::Kind::event;
    task.done.event = EventKind::movement_started;
    scenario.training.emplace().tasks = {task};
    scenario.training->on_command = false;
    start(test::two_robots_configuration(scenario));
  }
  std::shared_ptr<test::ListeningClient> follow(std::uint64_t id, const std::string& robot) {
    auto client = open(id);
    Subscription wanted;
    wanted.robot = robot;
    feed_->subscribe(id, wanted);
    client->sent.clear();
    return client;
  }
  void take_from(const std::string& robot, const char* canonical, const auto& item) {
    take(robot_channel(canonical, robot), item);
  }
};

TEST_F(SeveralRobotsFeedTest, HelloListsTheRobots) {
  const auto hello = open()->newest("hello");
  EXPECT_EQ(hello["session"]["robots"], (nlohmann::json{kRover1, kRover2}));
  EXPECT_EQ(hello["session"]["robot"], kRover1);
}

TEST_F(SeveralRobotsFeedTest, APageGetsTheScansOfTheRobotThatItFollows) {
  const auto one = follow(1, kRover1), other = follow(2, kRover2);
  take_from(kRover2, channel::kScan, test::scan_at(0));
  EXPECT_EQ(one->frames(2).size(), 0U);
  EXPECT_EQ(other->frames(2).size(), 1U);
}

TEST_F(SeveralRobotsFeedTest, APageGetsTheScoreOfTheRobotThatItFollows) {
  const auto one = follow(1, kRover1), other = follow(2, kRover2);
  report_event(EventKind::score_changed, kRover2, "drive", 7);
  pass(0.1);
  EXPECT_EQ(other->newest("score")["score"], 7);
  const auto scores = one->messages_of_type("score");
  for (const auto& score : scores) EXPECT_EQ(score["score"], 0);
}

TEST_F(SeveralRobotsFeedTest, OneRobotsLostInjectionIsThatPagesAlone) {
  const auto one = follow(1, kRover1), other = follow(2, kRover2);
  ScanInfo info;
  info.stamp = sensor_time();
  info.live = true;
  take_from(kRover1, channel::kMrScanInfo, info);
  info.live = false;
  info.reason = "no pose: lost";
  take_from(kRover2, channel::kMrScanInfo, info);
  pass(0.6);
  EXPECT_EQ(one->newest("injection")["live"], true);
  EXPECT_EQ(other->newest("injection")["live"], false);
  // Everybody's list has both.
  const auto list = one->newest("robots")["list"];
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[0]["injecting"], true);
  EXPECT_EQ(list[1]["injecting"], false);
  EXPECT_EQ(list[1]["reason"], "no pose: lost");
}

TEST_F(SeveralRobotsFeedTest, ASwitchSendsTheStateOfTheOtherRobotAtOnce) {
  ScanInfo info;
  info.stamp = sensor_time();
  info.reason = "no scan";
  take_from(kRover2, channel::kMrScanInfo, info);
  const auto client = open();
  EXPECT_TRUE(client->newest("injection").is_null()) << "rover_1 has none yet";
  Subscription wanted;
  wanted.robot = kRover2;
  feed_->subscribe(1, wanted);
  EXPECT_EQ(client->newest("injection")["reason"], "no scan");
  EXPECT_FALSE(client->newest("score").is_null());
}

TEST_F(SeveralRobotsFeedTest, AnUnknownRobotIsTheFirst) {
  const auto client = follow(1, "nobody");
  take_from(kRover1, channel::kScan, test::scan_at(0));
  EXPECT_EQ(client->frames(2).size(), 1U);
}

TEST(SeveralRobotsConsole, DrivesEachRobotOnItsOwnChannels) {
  WorldMessage world;
  world.robot = "rover_1 rover_2";
  const auto robots = robots_in(world);
  ASSERT_EQ(robots.size(), 2U);
  EXPECT_EQ(robots[1].name, "rover_2");
  EXPECT_EQ(robots[1].teleop, "TELEOP.rover_2");
  EXPECT_EQ(robots[1].joints, "JOINT_CMD.rover_2");
  world.robot = "rover";
  EXPECT_EQ(robots_in(world).front().teleop, "TELEOP");
}

/// A stop that another console requests is followed for the robot that it is about, or for all.
TEST(SeveralRobotsStops, AnotherConsolesStopIsForTheRobotsThatItNames) {
  MemoryBusHub hub;
  const auto bus = hub.connect();
  TeleopOptions options;
  options.now = [] { return WallTime{1}; };
  options.stamp = [] { return SensorTime{1}; };
  options.robots = {kRover1, kRover2};
  TeleopService service(*bus, std::move(options));
  const auto stopped_after = [&](const std::string& robot, bool engaged, std::uint64_t request) {
    service.handle(EmergencyStopCommand{.request = request, .robot = robot, .engaged = engaged});
    Event answer;
    answer.kind = EventKind::command_accepted;
    answer.request = request;
    service.handle(answer);
    std::vector<std::string> names;
    for (const EmergencyStop& stop : service.stops()) names.push_back(stop.robot);
    return names;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(stopped_after(kRover2, true, 1), Names{kRover2});
  EXPECT_EQ(stopped_after("", true, 2), (Names{kRover1, kRover2}));
  EXPECT_EQ(stopped_after(kRover1, false, 3), Names{kRover2});
  EXPECT_EQ(stopped_after("", false, 4), Names{});
}

}  // namespace
}  // namespace parhelion::station
