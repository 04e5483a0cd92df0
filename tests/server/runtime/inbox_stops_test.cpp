#include <map>

#include "tests/server/runtime/inbox_fixture.hpp"

namespace parhelion::runtime {
namespace {

/// Whatever waits. A release that came before a stop must not follow it.
TEST_F(InboxTest, InboxTakesEmergencyStopsFirstAndInOrder) {
  Inbox inbox(*server_, configuration_, {{&guard_}});
  for (std::uint8_t i = 0; i < 50; ++i) {
    send_scan(i);
    send("TELEOP", i);
    send("MR_SPAWN", i);
    if (i % 10 == 9) send_stop("", i % 20 == 9, i);
  }
  const auto all = take_all(inbox);
  ASSERT_EQ(all.size(), 155U);
  std::vector<int> stops;
  std::size_t last = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].message.channel != "MR_EMERGENCY_STOP") continue;
    EmergencyStopCommand command;
    ASSERT_TRUE(decode(all[i].message.channel, all[i].message.payload, command));
    EXPECT_EQ(command.engaged, command.request % 20 == 9);
    stops.push_back(static_cast<int>(command.request));
    last = i;
  }
  EXPECT_EQ(stops, (std::vector<int>{9, 19, 29, 39, 49}));
  EXPECT_LT(last, 10U) << "at most one input of the robot between two";
}

/// Whose turn it is, and however many stops came before.
TEST_F(InboxTest, InboxTakesAStopBeforeTheInputsOfRobotsButNotOnlyStops) {
  Inbox inbox(*server_, configuration_, {{&guard_}});
  for (int i = 0; i < 4; ++i) send("TELEOP");
  for (int i = 0; i < 3; ++i) send_stop("", true);
  std::vector<bool> stops;
  for (const Arrived& taken : take_all(inbox)) stops.push_back(taken.message.channel != "TELEOP");
  EXPECT_EQ(stops, (std::vector<bool>{true, false, true, false, true, false, false}));
}

/// It would be refused before the command that makes the agent, which then drove.
TEST_F(InboxTest, InboxTakesTheStopOfAnAgentBehindTheCommandThatMakesIt) {
  Inbox inbox(*server_, configuration_, {{&guard_}});
  send("MR_SPAWN");
  send_stop("robot_1", true);
  send_stop("rover", true);
  const auto all = take_all(inbox);
  ASSERT_EQ(all.size(), 3U);
  std::vector<std::string> robots;
  for (const Arrived& taken : all) {
    EmergencyStopCommand command;
    const bool stop = decode(taken.message.channel, taken.message.payload, command).ok();
    robots.push_back(stop ? command.robot : taken.message.channel);
  }
  EXPECT_EQ(robots, (std::vector<std::string>{"rover", "MR_SPAWN", "robot_1"}));
}

TEST_F(InboxTest, InboxTakesAStopWhateverElseWaits) {
  InboxLimits limits;
  limits.bytes = 40 * (1 + sizeof(Arrived));
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  for (int i = 0; i < 100; ++i) send("MR_SPAWN");
  send_stop("", true);
  const auto all = take_all(inbox);
  ASSERT_EQ(all.size(), 41U);
  EXPECT_EQ(all[0].message.channel, "MR_EMERGENCY_STOP");
}

/// Whatever is sent, the last word about each robot is a stop if a stop was sent last.
TEST_F(InboxTest, InboxBoundsStopsAndReleasesAndFreesNoRobot) {
  InboxLimits limits;
  limits.stops = 10;
  const std::vector<std::string> robots = {"rover", "hauler"};
  configuration_ = robots_named(robots);
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  for (int i = 0; i < 500; ++i) {
    send_stop("rover", true);
    send_stop("rover", false);
    send_stop("hauler", i % 2 == 0);
  }
  send_stop("rover", true);
  send_stop("hauler", true);
  std::map<std::string, bool> stopped;
  std::size_t count = 0;
  for (const Arrived& taken : take_all(inbox)) {
    EmergencyStopCommand command;
    ASSERT_TRUE(decode(taken.message.channel, taken.message.payload, command));
    stopped[command.robot] = command.engaged;
    ++count;
  }
  EXPECT_LE(count, limits.stops + robots.size() + 1);
  EXPECT_TRUE(stopped["rover"]);
  EXPECT_TRUE(stopped["hauler"]);
}

}  // namespace
}  // namespace parhelion::runtime
