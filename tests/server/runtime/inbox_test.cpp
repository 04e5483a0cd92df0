#include "server/runtime/inbox.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <thread>

#include "server/runtime/wall_clock.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::runtime {
namespace {

tick::Configuration robots_named(const std::vector<std::string>& names) {
  tick::Configuration configuration;
  configuration.robot.name = names.front();
  configuration.other_robots.resize(names.size() - 1);
  for (std::size_t i = 1; i < names.size(); ++i) configuration.other_robots[i - 1].name = names[i];
  return configuration;
}

class InboxTest : public testing::Test {
 protected:
  InboxTest()
      : server_(hub_.connect()),
        robot_(hub_.connect()),
        guard_(seconds(1000),
               [this](std::span<const std::uint8_t> scan) { sent_raw_.push_back(scan.back()); }) {
    EXPECT_TRUE(server_->subscribe(".*", 20'000).ok());
  }
  /// The inbox checks the length only; the mark is the last byte of radstep.
  void send_scan(std::uint8_t mark) {
    std::vector<std::uint8_t> bytes;
    encode(Scan{}, bytes);
    bytes.back() = mark;
    ASSERT_TRUE(robot_->publish("SCAN", bytes).ok());
  }
  void send(const std::string& channel, std::uint8_t byte = 1) {
    const std::uint8_t bytes[] = {byte};
    ASSERT_TRUE(robot_->publish(channel, bytes).ok());
  }
  void send_stop(const std::string& robot, bool engaged, std::uint64_t request = 1) {
    EmergencyStopCommand command;
    command.robot = robot;
    command.engaged = engaged;
    command.request = request;
    std::vector<std::uint8_t> bytes;
    encode(command, bytes);
    ASSERT_TRUE(robot_->publish("MR_EMERGENCY_STOP", bytes).ok());
  }
  /// Takes everything that was sent.
  std::vector<Arrived> take_all(Inbox& inbox) {
    inbox.close();
    std::vector<Arrived> all;
    while (auto arrived = inbox.take(steady_now())) all.push_back(std::move(*arrived));
    return all;
  }

  MemoryBusHub hub_;
  std::unique_ptr<Bus> server_, robot_;
  std::vector<int> sent_raw_;
  tick::Configuration configuration_ = robots_named({"rover"});
  Guard guard_;
};

TEST_F(InboxTest, InboxWakesUpWithoutMessages) {
  Inbox inbox(*server_, configuration_, {{&guard_}});
  const WallTime begun = steady_now();
  inbox.wake();
  EXPECT_FALSE(inbox.take(begun + seconds(60))) << "woken before it waited";
  std::thread other([&inbox] { inbox.wake(); });
  EXPECT_FALSE(inbox.take(begun + seconds(60)));
  other.join();
  EXPECT_LT(steady_now() - begun, seconds(30));
  send("ODOMETRY");
  EXPECT_TRUE(inbox.take(steady_now() + seconds(20))) << "a wake is used up";
}

TEST_F(InboxTest, InboxStampsStrictlyIncreasing) {
  Inbox inbox(*server_, configuration_, {{&guard_}});
  for (int i = 0; i < 100; ++i) send("ODOMETRY");
  ArrivalTime last{0};
  for (int i = 0; i < 100; ++i) {
    const auto arrived = inbox.take(steady_now() + seconds(10));
    ASSERT_TRUE(arrived);
    ASSERT_GT(arrived->message.arrival, last);
    ASSERT_EQ(arrived->message.arrival.ns % 1000, 0) << "a log keeps microseconds";
    last = arrived->message.arrival;
    const ArrivalTime timer = inbox.stamp();
    ASSERT_GT(timer, last);
    last = timer;
  }
}

TEST_F(InboxTest, InboxNeverDropsQueuedScansAndCommands) {
  Inbox inbox(*server_, configuration_, {{&guard_}});
  for (int i = 0; i < 400; ++i) {
    send_scan(static_cast<std::uint8_t>(i));
    send("MR_SPAWN", static_cast<std::uint8_t>(i));
    send("ODOMETRY");
  }
  int scans = 0, commands = 0, others = 0;
  for (const Arrived& arrived : take_all(inbox)) {
    if (arrived.message.channel == "SCAN") {
      EXPECT_EQ(arrived.message.payload.back(), scans++ % 256) << "in order";
      EXPECT_EQ(arrived.ticket, static_cast<std::uint64_t>(scans)) << "the guard watches it";
    } else if (arrived.message.channel == "MR_SPAWN") {
      EXPECT_EQ(arrived.message.payload.back(), commands++ % 256) << "in order";
    } else {
      ++others;
    }
  }
  EXPECT_EQ(scans, 400);
  EXPECT_EQ(commands, 400);
  EXPECT_EQ(others, 256);
  EXPECT_EQ(inbox.dropped(), 400U - 256U);
  EXPECT_EQ(inbox.take_given_up(), 0U);
}

TEST_F(InboxTest, InboxPassesTheOldestScansToTheGuardUnderMemoryPressure) {
  std::vector<std::uint8_t> one;
  encode(Scan{}, one);
  InboxLimits limits;
  limits.bytes = 10 * one.size();
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  for (int i = 0; i < 25; ++i) send_scan(static_cast<std::uint8_t>(i));
  const auto taken = take_all(inbox);
  const std::uint64_t given_up = inbox.take_given_up();
  EXPECT_EQ(given_up, 15U);
  EXPECT_EQ(taken.size(), 10U);
  EXPECT_EQ(inbox.take_given_up(), 0U) << "reported once";
  EXPECT_EQ(inbox.dropped(), given_up);
  ASSERT_EQ(sent_raw_.size(), given_up);
  for (std::size_t i = 0; i < sent_raw_.size(); ++i)
    EXPECT_EQ(sent_raw_[i], static_cast<int>(i)) << "in order";
  for (std::size_t i = 0; i < taken.size(); ++i) {
    EXPECT_EQ(taken[i].message.payload.back(), given_up + i) << "the newest are still there";
  }
}

TEST_F(InboxTest, InboxRefusesNewCommandsUnderMemoryPressure) {
  InboxLimits limits;
  limits.bytes = 10;
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  for (int i = 0; i < 25; ++i) send("MR_SPAWN", static_cast<std::uint8_t>(i));
  send_scan(77);
  int commands = 0, scans = 0;
  for (const Arrived& taken : take_all(inbox)) {
    const bool is_scan = taken.message.channel == "SCAN";
    scans += is_scan;
    if (!is_scan) {
      EXPECT_EQ(taken.message.payload[0], commands++);
    }
  }
  EXPECT_EQ(commands, 10);
  EXPECT_EQ(scans, 1) << "it is kept whatever the commands take";
  EXPECT_EQ(inbox.dropped(), 15U);
}

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
  limits.bytes = 40;
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

TEST_F(InboxTest, InboxTakesACommandInTurnWithTheInputsOfARobotThatSendsTooMuch) {
  Inbox inbox(*server_, configuration_, {{&guard_}});
  for (int i = 0; i < 1000; ++i) send("TELEOP");
  send("MR_SPAWN", 7);
  const auto all = take_all(inbox);
  ASSERT_EQ(all.size(), 1001U);
  EXPECT_TRUE(all[0].message.channel == "MR_SPAWN" || all[1].message.channel == "MR_SPAWN");
}

class InboxRefusalTest : public InboxTest {
 protected:
  void send_spawn(std::uint64_t request) { send_spawn(request, *robot_); }
  static void send_spawn(std::uint64_t request, Bus& sender) {
    AgentSpawn spawn;
    spawn.request = request;
    spawn.agent.name = "box_1";
    std::vector<std::uint8_t> bytes;
    encode(spawn, bytes);
    ASSERT_TRUE(sender.publish("MR_SPAWN", bytes).ok());
  }
  static std::uint64_t request_of(const Arrived& arrived) {
    AgentSpawn spawn;
    return decode(arrived.message.channel, arrived.message.payload, spawn) ? spawn.request : 0;
  }
};

TEST_F(InboxRefusalTest, InboxRefusesNoCommandOfASenderForTheFloodOfAnother) {
  InboxLimits limits;
  limits.commands = 20;
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  const auto instructor = hub_.connect();
  for (std::uint64_t i = 1; i <= 100; ++i) send_spawn(i);
  send_stop("robot_1", true);
  send_spawn(1000, *instructor);
  send_spawn(1001, *instructor);
  for (std::uint64_t i = 101; i <= 200; ++i) send_spawn(i);
  std::vector<std::uint64_t> requests;
  int stops = 0;
  for (const Arrived& taken : take_all(inbox)) {
    if (taken.message.channel == "MR_SPAWN")
      requests.push_back(request_of(taken));
    else
      ++stops;
  }
  ASSERT_EQ(requests.size(), 20U);
  EXPECT_TRUE(std::is_sorted(requests.begin(), requests.end())) << "in the order in which they came";
  EXPECT_EQ(requests[18], 1000U);
  EXPECT_EQ(requests[19], 1001U);
  EXPECT_EQ(stops, 1) << "the stop of an agent is no command that is refused";
  const auto refused = inbox.take_refused_commands();
  EXPECT_EQ(refused.size(), 182U);
  EXPECT_LE(*std::max_element(refused.begin(), refused.end()), 200U);
}

/// Not one a turn: the replies must come while somebody waits for them.
TEST_F(InboxRefusalTest, InboxRefusesAllLateCommandsAtOnce) {
  InboxLimits limits;
  limits.command_age = milliseconds(1);
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  EXPECT_FALSE(inbox.take(steady_now())) << "from here on commands age";
  for (std::uint64_t i = 1; i <= 500; ++i) send_spawn(i);
  for (int i = 0; i < 10; ++i) send("ODOMETRY");
  inbox.close();
  const WallTime received = steady_now();
  while (steady_now() - received <= milliseconds(1)) std::this_thread::yield();  // the loop is behind
  ASSERT_TRUE(inbox.take(steady_now()));
  EXPECT_EQ(inbox.take_refused_commands().size(), 500U);
}

TEST_F(InboxRefusalTest, InboxRefusesCommandsBeyondItsLimitByTheirRequests) {
  InboxLimits limits;
  limits.commands = 20;
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  for (std::uint64_t i = 1; i <= 50; ++i) send_spawn(i);
  send_stop("", true);
  send_scan(1);
  const auto all = take_all(inbox);
  EXPECT_EQ(all.size(), 22U) << "stop and scan are not limited by commands";
  const auto refused = inbox.take_refused_commands();
  ASSERT_EQ(refused.size(), 30U);
  for (std::size_t i = 0; i < refused.size(); ++i) EXPECT_EQ(refused[i], 21 + i) << "the newest, in order";
  EXPECT_EQ(inbox.dropped(), 30U);
  EXPECT_TRUE(inbox.take_refused_commands().empty()) << "reported once";
}

TEST_F(InboxRefusalTest, InboxRemembersALimitedNumberOfRefusals) {
  InboxLimits limits;
  limits.commands = 1;
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  const std::uint64_t count = 2 * Inbox::kMaxRefusals;
  for (std::uint64_t i = 1; i <= count; ++i) send_spawn(i);
  EXPECT_EQ(take_all(inbox).size(), 1U);
  EXPECT_EQ(inbox.take_refused_commands().size(), Inbox::kMaxRefusals);
  EXPECT_EQ(inbox.dropped(), count - 1) << "all are counted";
}

/// Its sender was told that there is no reply: it must not happen later. A stop must.
TEST_F(InboxRefusalTest, InboxRefusesCommandsThatWaitedTooLongButNoStop) {
  InboxLimits limits;
  limits.command_age = milliseconds(50);
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  EXPECT_FALSE(inbox.take(steady_now())) << "from here on commands age";
  for (std::uint64_t i = 1; i <= 3; ++i) send_spawn(i);
  send_stop("", true);
  send("TELEOP");
  std::this_thread::sleep_for(std::chrono::milliseconds(120));  // the loop is behind
  const auto all = take_all(inbox);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(inbox.take_refused_commands(), (std::vector<std::uint64_t>{1, 2, 3}));
}

TEST_F(InboxTest, InboxPassesOnlyScansToTheGuard) {
  Inbox inbox(*server_, configuration_, {{&guard_}});
  send("SCAN");
  const auto taken = take_all(inbox);
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(taken[0].ticket, 0U);
  guard_.give_up(100);
  EXPECT_TRUE(sent_raw_.empty());
}

TEST_F(InboxTest, InboxKeepsReceivedMessagesWhenItCloses) {
  Inbox inbox(*server_, configuration_, {{&guard_}});
  for (int i = 0; i < 50; ++i) send_scan(static_cast<std::uint8_t>(i));
  inbox.close();
  send_scan(50);
  for (int i = 0; i < 50; ++i) {
    const auto arrived = inbox.take(steady_now());
    ASSERT_TRUE(arrived);
    EXPECT_EQ(arrived->message.payload.back(), i);
  }
  EXPECT_FALSE(inbox.take(steady_now()));
}

TEST_F(InboxTest, InboxReturnsAtTheDeadlineWithoutMessages) {
  Inbox inbox(*server_, configuration_, {{&guard_}});
  const WallTime deadline = steady_now() + milliseconds(5);
  EXPECT_FALSE(inbox.take(deadline));
  EXPECT_GE(steady_now(), deadline);
}

TEST_F(InboxTest, InboxReportsAForeignPublisherOnceAMinuteAndChannel) {
  Scenario scenario;
  scenario.level = 1;
  scenario.trainee.emplace();
  tick::Configuration simulated;
  simulated.scenario = scenario;
  simulated.channels = tick::ChannelMap(scenario);
  SentMessages sent(simulated);
  Inbox inbox(*server_, simulated, {{&guard_}}, {}, &sent);
  const std::uint8_t own[] = {7};
  sent.add("IMU", own);
  const WallTime start = steady_now();
  // TELEOP arrives after everything sent before it.
  const auto taken_after = [&](double t, std::initializer_list<const char*> channels) {
    for (const char* channel : channels) send(channel);
    EXPECT_TRUE(robot_->publish("IMU", own).ok());
    send("TELEOP");
    EXPECT_TRUE(inbox.take(steady_now() + seconds(10)));
    return inbox.take_foreign(start + seconds(t)).size();
  };
  EXPECT_EQ(taken_after(0, {"SCAN", "SCAN"}), 1U);
  EXPECT_EQ(taken_after(1, {"SCAN", "ODOMETRY"}), 1U) << "only the other channel is news";
  EXPECT_EQ(taken_after(59, {"SCAN"}), 0U);
  EXPECT_EQ(taken_after(61.5, {"SCAN", "ODOMETRY"}), 2U);
  EXPECT_EQ(taken_after(200, {}), 0U) << "not reported again";
}

}  // namespace
}  // namespace parhelion::runtime
