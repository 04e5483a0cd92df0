#include <algorithm>
#include <thread>

#include "tests/server/runtime/inbox_fixture.hpp"
#include "tests/wall_clock_step.hpp"

namespace parhelion::runtime {
namespace {

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
  static std::uint64_t request_of_stop(const Arrived& arrived) {
    EmergencyStopCommand command;
    return decode(arrived.message.channel, arrived.message.payload, command) ? command.request : 0;
  }
  /// The loop takes nothing for longer than this.
  static void be_behind(Duration age) {
    const WallTime from = steady_now();
    while (steady_now() - from <= age) std::this_thread::yield();
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
  be_behind(milliseconds(1));
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
  inbox.close();
  be_behind(milliseconds(50));
  const auto all = take_all(inbox);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(inbox.take_refused_commands(), (std::vector<std::uint64_t>{1, 2, 3}));
}

/// Its sender, and whoever stands before the robot, believe that it is stopped.
TEST_F(InboxRefusalTest, InboxRefusesAReleaseThatWaitedTooLong) {
  InboxLimits limits;
  limits.command_age = milliseconds(50);
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  EXPECT_FALSE(inbox.take(steady_now())) << "from here on commands age";
  send_stop("rover", false, 1);
  send_stop("rover", true, 2);
  send_stop("", false, 3);
  send_stop("robot_1", false, 4);  // an agent's
  send_stop("robot_1", true, 5);
  inbox.close();
  be_behind(milliseconds(50));
  std::vector<std::uint64_t> taken;
  for (const Arrived& each : take_all(inbox)) taken.push_back(request_of_stop(each));
  EXPECT_EQ(taken, (std::vector<std::uint64_t>{2, 5}));
  std::vector<std::uint64_t> refused = inbox.take_refused_commands();
  std::sort(refused.begin(), refused.end());
  EXPECT_EQ(refused, (std::vector<std::uint64_t>{1, 3, 4}));
}

/// A bus whose first messages waited in the kernel while the process was paused.
class LateBus : public Bus {
 public:
  LateBus(Bus& bus, Duration age, int messages) : bus_(bus), age_(age), messages_(messages) {}
  Result<bool> receive(Message& message, Duration timeout) override {
    auto received = bus_.receive(message, timeout);
    if (received && *received && messages_-- > 0) message.arrival = message.arrival + Duration{-age_.ns};
    return received;
  }
  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override {
    return bus_.publish(channel, payload);
  }
  Status subscribe(const std::string& pattern, int capacity) override {
    return bus_.subscribe(pattern, capacity);
  }
  std::uint64_t dropped() const override { return bus_.dropped(); }

 private:
  Bus& bus_;
  const Duration age_;
  int messages_;
};

/// A station sends a release several times. Once its sender was told that the robot stays stopped, it does.
TEST_F(InboxRefusalTest, InboxRefusesTheLaterCopiesOfAReleaseThatItRefused) {
  InboxLimits limits;
  limits.command_age = seconds(1.0);
  LateBus bus(*server_, seconds(10.0), 1);
  Inbox inbox(bus, configuration_, {{&guard_}}, limits);
  EXPECT_FALSE(inbox.take(steady_now()));
  be_behind(limits.command_age);  // nothing is older than the first take
  for (const std::uint64_t request : {7, 7, 8}) send_stop("", false, request);
  const auto all = take_all(inbox);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(request_of_stop(all[0]), 8U) << "another release is none of its copies";
  EXPECT_EQ(inbox.take_refused_commands(), (std::vector<std::uint64_t>{7})) << "one reply is enough";
}

TEST_F(InboxRefusalTest, InboxTakesAReleaseThatDidNotWaitTooLong) {
  InboxLimits limits;
  limits.command_age = seconds(1000);
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  EXPECT_FALSE(inbox.take(steady_now()));
  send_stop("rover", true, 1);
  send_stop("rover", false, 2);
  EXPECT_EQ(take_all(inbox).size(), 2U);
  EXPECT_TRUE(inbox.take_refused_commands().empty());
}

TEST_F(InboxRefusalTest, InboxRefusesWhatWaitedInTheKernelOfAPausedProcess) {
  LateBus bus(*server_, seconds(10.0), 3);
  InboxLimits limits;
  limits.command_age = milliseconds(50);
  Inbox inbox(bus, configuration_, {{&guard_}}, limits);
  EXPECT_FALSE(inbox.take(steady_now()));
  be_behind(milliseconds(50));  // nothing is older than the first take
  send_spawn(1);
  send_stop("", false, 2);
  send_stop("", true, 3);
  const auto all = take_all(inbox);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(request_of_stop(all[0]), 3U);
  EXPECT_EQ(inbox.take_refused_commands(), (std::vector<std::uint64_t>{2, 1}));
}

/// An administrator, or a time server, sets the clock while they wait.
TEST_F(InboxRefusalTest, InboxTakesWhatWaitsWhileTheWallClockIsSet) {
  InboxLimits limits;
  limits.command_age = milliseconds(1000);
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  EXPECT_FALSE(inbox.take(steady_now()));
  be_behind(milliseconds(1000));  // nothing is older than the first take
  send_spawn(1);
  send_stop("", false, 2);
  send("TELEOP");
  inbox.close();
  for (const double step : {3600.0, -3600.0, 3600.0}) {
    const WallTime before = wall_now();
    const test::WallClockStep set(seconds(step));
    EXPECT_NEAR((wall_now() - before).seconds(), step, 10);
    const auto arrived = inbox.take(steady_now());
    ASSERT_TRUE(arrived) << step;
    EXPECT_LT(arrived->age, seconds(1000)) << step;
    EXPECT_GE(arrived->age.ns, 0) << step;
  }
  EXPECT_TRUE(inbox.take_refused_commands().empty());
}

TEST_F(InboxRefusalTest, AStopOfAnAgentIsNotGivenUpForItsRelease) {
  InboxLimits limits;
  limits.stops = 3;
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  send_stop("agent_1", true, 1);
  send_stop("agent_1", false, 2);
  send_stop("agent_2", true, 3);
  send_stop("agent_1", true, 4);
  std::vector<std::uint64_t> taken;
  for (const auto& each : take_all(inbox)) taken.push_back(request_of_stop(each));
  EXPECT_EQ(taken, (std::vector<std::uint64_t>{1, 3, 4}));
  EXPECT_EQ(inbox.take_refused_commands(), (std::vector<std::uint64_t>{2}));
}

/// Each waits in turn, behind the command that makes its agent. Releases (odd) leave before stops.
TEST_F(InboxRefusalTest, InboxBoundsTheStopsOfAgentsFairly) {
  InboxLimits limits;
  limits.stops = 10;
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  for (std::uint64_t i = 1; i <= 100; ++i) send_stop("agent_" + std::to_string(i), i % 2 == 0, i);
  const auto instructor = hub_.connect();
  std::vector<std::uint8_t> bytes;
  EmergencyStopCommand stop;
  stop.robot = "robot_1";
  stop.request = 1000;
  stop.engaged = true;
  encode(stop, bytes);
  ASSERT_TRUE(instructor->publish("MR_EMERGENCY_STOP", bytes).ok());
  send_spawn(1001);
  std::vector<std::uint64_t> requests;
  for (const Arrived& taken : take_all(inbox))
    requests.push_back(std::max(request_of(taken), request_of_stop(taken)));
  EXPECT_EQ(requests, (std::vector<std::uint64_t>{2, 4, 6, 8, 10, 12, 14, 16, 18, 1000, 1001}));
  const auto refused = inbox.take_refused_commands();
  EXPECT_EQ(refused.size(), 91U) << "each is answered";
}

TEST_F(InboxRefusalTest, InboxRefusesAReleaseBeyondItsLimitByItsRequest) {
  InboxLimits limits;
  limits.stops = 2;
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  for (std::uint64_t i = 1; i <= 4; ++i) send_stop("", false, i);
  send_stop("", true, 5);
  EXPECT_EQ(take_all(inbox).size(), 3U);
  EXPECT_EQ(inbox.take_refused_commands(), (std::vector<std::uint64_t>{3, 4}));
}

}  // namespace
}  // namespace parhelion::runtime
