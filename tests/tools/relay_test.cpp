// The robot's relay: what it passes on, and that a silent server means a stop.
#include "tools/relay.hpp"

#include <gtest/gtest.h>

#include <map>

#include "protocols/authentication/signed_bus.hpp"
#include "protocols/codec.hpp"
#include "protocols/driving_timing.hpp"
#include "server/runtime/wall_clock.hpp"

namespace parhelion::tools {
namespace {

class RelayTest : public ::testing::Test {
 protected:
  RelayTest() {
    const Sender server{"server", new_secret(), {"server"}, {}};
    const Sender rover{"rover", new_secret(), {"robot"}, {}};
    const Keys at_robot{rover.name, rover.secret, seconds(1.0), {server}};
    server_ = sign(site_.connect(), {server.name, server.secret, seconds(1.0), {rover}}, {});
    stranger_ = site_.connect();
    to_site_ = sign(site_.connect(), at_robot, {});
    to_robot_ = robot_.connect();
    motor_ = robot_.connect();
    relay_.emplace(*to_site_, *to_robot_);
    for (const std::string& channel : channels_to_robot()) {
      EXPECT_TRUE(to_site_->subscribe(channel, 64));
      EXPECT_TRUE(motor_->subscribe(channel, 64));
    }
  }

  static std::vector<std::uint8_t> drive(double vx) {
    std::vector<std::uint8_t> payload;
    encode(TwistCommand{{runtime::wall_now().ns}, {vx, 0, 0}}, payload);
    return payload;
  }
  /// Runs the relay for at least `span`, until nothing waits, and returns what the motor got since the last
  /// call.
  std::vector<float> speeds_after(Duration span) {
    const WallTime until = runtime::steady_now() + span;
    do {
      const Status turned = relay_->turn(milliseconds(5));
      EXPECT_TRUE(turned);
    } while (runtime::steady_now() < until);
    std::vector<float> speeds;
    Message message;
    while (*motor_->receive(message, Duration{0})) {
      TwistCommand command;
      if (decode(message.channel, message.payload, command))
        speeds.push_back(static_cast<float>(command.twist.vx));
    }
    return speeds;
  }

  MemoryBusHub site_, robot_;
  std::unique_ptr<Bus> server_, stranger_, to_site_, to_robot_, motor_;
  std::optional<RelayToRobot> relay_;
};

TEST_F(RelayTest, PassesTheServersCommandsOnAndNobodyElses) {
  ASSERT_TRUE(stranger_->publish("MR_CMD", drive(9)));
  ASSERT_TRUE(server_->publish("MR_CMD", drive(0.3)));
  ASSERT_TRUE(stranger_->publish("MR_CMD", drive(8)));
  EXPECT_EQ(speeds_after(milliseconds(50)), std::vector<float>{0.3F});
}

TEST_F(RelayTest, StopsTheRobotOnceTheServerIsSilent) {
  ASSERT_TRUE(server_->publish("MR_CMD", drive(0.3)));
  EXPECT_EQ(speeds_after(driving_timing::kRelaySilence + milliseconds(50)), (std::vector<float>{0.3F, 0}));
  EXPECT_TRUE(speeds_after(driving_timing::kRelaySilence).empty()) << "once";
}

TEST_F(RelayTest, SendsNoStopAfterOneOfTheServer) {
  ASSERT_TRUE(server_->publish("MR_CMD", drive(0.3)));
  ASSERT_TRUE(server_->publish("MR_CMD", drive(0)));
  EXPECT_EQ(speeds_after(driving_timing::kRelaySilence + milliseconds(50)), (std::vector<float>{0.3F, 0}));
}

TEST_F(RelayTest, StopsTheRobotAtItsEnd) {
  ASSERT_TRUE(server_->publish("MR_CMD", drive(0.3)));
  EXPECT_EQ(speeds_after(milliseconds(20)), std::vector<float>{0.3F});
  ASSERT_TRUE(relay_->stop());
  Message message;
  TwistCommand command;
  ASSERT_TRUE(*motor_->receive(message, milliseconds(100)));
  ASSERT_TRUE(decode(message.channel, message.payload, command));
  EXPECT_EQ(command.twist.vx, 0);
}

TEST_F(RelayTest, SignsWhatTheRobotSends) {
  ASSERT_TRUE(server_->subscribe("SCAN", 4));
  ASSERT_TRUE(to_robot_->subscribe("SCAN", 4));
  const std::vector<std::uint8_t> payload{1, 2, 3};
  ASSERT_TRUE(motor_->publish("SCAN", payload));
  Message message;
  ASSERT_TRUE(relay_from_robot(*to_robot_, *to_site_, message, milliseconds(100)));
  ASSERT_TRUE(*server_->receive(message, milliseconds(100)));
  EXPECT_EQ(message.payload, payload);
}

}  // namespace
}  // namespace parhelion::tools
