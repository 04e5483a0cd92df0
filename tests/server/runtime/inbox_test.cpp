#include <map>
#include <thread>

#include "tests/server/runtime/inbox_fixture.hpp"

namespace parhelion::runtime {
namespace {

Scenario with_pose() {
  Scenario scenario;
  scenario.level = 3;
  scenario.pose.emplace();
  return scenario;
}

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

/// Whatever the kind, it is bounded, the newest stay, and no other kind loses one.
TEST_F(InboxTest, InboxDropsTheOldestOfAKindThatFloods) {
  for (const char* flood :
       {"IMU", "JOINT_STATE", "POSE", "POSE_COV", "ODOMETRY", "TELEOP", "JOINT_CMD", "CAMERA", "DEPTH",
        "OPERATOR", "MR_AGENT_robot_1_TELEOP", "MR_AGENT_robot_1_JOINT_CMD"}) {
    configuration_.channels = tick::ChannelMap(std::string(flood) == "POSE" ? with_pose() : Scenario{});
    Inbox inbox(*server_, configuration_, {{&guard_}});
    const std::string other = std::string(flood) == "ODOMETRY" ? "IMU" : "ODOMETRY";
    send(other, 77);
    for (int i = 0; i < 1000; ++i) send(flood, static_cast<std::uint8_t>(i));
    int others = 0, taken = 0;
    for (const Arrived& each : take_all(inbox)) {
      others += each.message.channel == other;
      if (each.message.channel == flood) {
        EXPECT_EQ(each.message.payload[0], (1000 - 256 + taken++) % 256) << flood;
      }
    }
    EXPECT_EQ(taken, 256) << flood;
    EXPECT_EQ(others, 1) << flood;
    EXPECT_EQ(inbox.dropped(), 1000U - 256U) << flood;
  }
}

TEST_F(InboxTest, InboxBoundsTheBytesOfImagesAndKeepsWhatIsSmall) {
  InboxLimits limits;
  limits.other_bytes = 100'000;
  Inbox inbox(*server_, configuration_, {{&guard_}}, limits);
  for (int i = 0; i < 20; ++i) send("ODOMETRY");
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(robot_->publish(i % 2 == 0 ? "CAMERA" : "DEPTH", std::vector<std::uint8_t>(10'000)).ok());
  }
  std::map<std::string, std::size_t> taken;
  for (const Arrived& each : take_all(inbox)) ++taken[each.message.channel];
  EXPECT_EQ(taken["ODOMETRY"], 20U);
  EXPECT_LE(taken["CAMERA"] + taken["DEPTH"], 10U);
  EXPECT_GE(taken["CAMERA"], 1U);
  EXPECT_GE(taken["DEPTH"], 1U);
}

TEST_F(InboxTest, InboxPassesTheOldestScansToTheGuardUnderMemoryPressure) {
  std::vector<std::uint8_t> one;
  encode(Scan{}, one);
  InboxLimits limits;
  limits.bytes = 10 * (one.size() + sizeof(Arrived));
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
  limits.bytes = 10 * (1 + sizeof(Arrived));
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

TEST_F(InboxTest, InboxTakesACommandInTurnWithTheInputsOfARobotThatSendsTooMuch) {
  Inbox inbox(*server_, configuration_, {{&guard_}});
  for (int i = 0; i < 1000; ++i) send_scan(1);
  send("MR_SPAWN", 7);
  const auto all = take_all(inbox);
  ASSERT_EQ(all.size(), 1001U);
  EXPECT_TRUE(all[0].message.channel == "MR_SPAWN" || all[1].message.channel == "MR_SPAWN");
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
