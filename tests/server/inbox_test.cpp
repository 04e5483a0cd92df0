#include "server/inbox.hpp"

#include <gtest/gtest.h>

#include "server/wall_clock.hpp"
#include "tests/server/synthetic.hpp"

namespace parhelion {
namespace {

class InboxTest : public testing::Test {
 protected:
  InboxTest() : server_(hub_.connect()), robot_(hub_.connect()), guard_(seconds(10), [](auto) {}) {
    EXPECT_TRUE(server_->subscribe(".*", 1000).ok());
  }
  void send(const std::string& channel, std::uint8_t byte = 1) {
    const std::uint8_t bytes[] = {byte};
    ASSERT_TRUE(robot_->publish(channel, bytes).ok());
  }

  MemoryBusHub hub_;
  std::unique_ptr<Bus> server_, robot_;
  ChannelMap channels_{Scenario{}};
  Guard guard_;
};

TEST_F(InboxTest, InboxStampsStrictlyIncreasing) {
  Inbox inbox(*server_, channels_, guard_);
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

TEST_F(InboxTest, InboxKeepsScansAndCommandsWhereTheQueueIsFull) {
  Inbox inbox(*server_, channels_, guard_);
  for (int i = 0; i < 40; ++i) send("SCAN", static_cast<std::uint8_t>(i));
  for (int i = 0; i < 10; ++i) send("MR_AGENT_CMD", static_cast<std::uint8_t>(i));
  for (int i = 0; i < 900; ++i) send("ODOMETRY");
  send("TELEOP");  // a marker: what was sent before it has been received
  int scans = 0, commands = 0;
  while (const auto arrived = inbox.take(steady_now() + seconds(10))) {
    if (arrived->message.channel == "SCAN") {
      EXPECT_EQ(arrived->message.payload[0], scans++) << "in order";
      EXPECT_NE(arrived->ticket, 0U) << "the guard watches it";
    }
    if (arrived->message.channel == "MR_AGENT_CMD") ++commands;
    if (arrived->message.channel == "TELEOP") break;
  }
  EXPECT_EQ(scans, 40);
  EXPECT_EQ(commands, 10);
}

TEST_F(InboxTest, InboxReturnsAtTheDeadlineWhereNothingComes) {
  Inbox inbox(*server_, channels_, guard_);
  const WallTime deadline = steady_now() + milliseconds(5);
  EXPECT_FALSE(inbox.take(deadline));
  EXPECT_GE(steady_now(), deadline);
}

}  // namespace
}  // namespace parhelion
