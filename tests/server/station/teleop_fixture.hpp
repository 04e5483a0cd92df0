// A teleop service between pages and a bus, on a clock that the test controls.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/station/teleop_service.hpp"
#include "tests/server/station/recording_client.hpp"

namespace parhelion::station {

inline constexpr const char* kAgentTeleop = "MR_AGENT_robot_2_TELEOP";

class TeleopServiceTest : public testing::Test {
 protected:
  TeleopServiceTest() : service_bus_(hub_.connect()), server_(hub_.connect()) {
    EXPECT_TRUE(server_->subscribe(".*", 10000).ok());
    service_ = std::make_unique<TeleopService>(
        *service_bus_,
        TeleopOptions{
            [this] { return now_; }, [this] { return SensorTime{1'700'000'000'000'000'000 + now_.ns}; },
            [this](const std::string& who, const std::string& what) { audited_.push_back(who + " " + what); },
            [this](const std::vector<EmergencyStop>& stops) { stops_ = stops; }});
    service_->set_robots(robots());
  }
  static std::vector<TeleopRobot> robots() {
    TeleopRobot trainee;
    trainee.driven = {"trainee", channel::kTeleop, channel::kJointCmd};
    trainee.vx = 1.0, trainee.vy = 0, trainee.wz = 2.0;
    trainee.joints = {{"arm", "revolute", -1, 1, 0.5}};
    TeleopRobot agent;
    agent.driven = {"robot_2", kAgentTeleop, ""};
    return {trainee, agent};
  }
  std::shared_ptr<RecordingClient> open(const std::string& name, Role role = Role::trainee) {
    auto client = RecordingClient::make(++clients_, name, role);
    handler_.opened(client);
    return client;
  }
  void send_text(RecordingClient& client, const std::string& text) { handler_.received(client, text, false); }
  void close(RecordingClient& client) { handler_.closed(client); }
  /// The page's clock equals ours; the message was sent `left_before` s before its arrival.
  void twist(RecordingClient& client, double vx, double wz = 0, double left_before = 0) {
    char text[160];
    std::snprintf(text, sizeof text, R"({"type":"twist","seq":%llu,"at_ms":%.3f,"vx":%g,"vy":0,"wz":%g})",
                  static_cast<unsigned long long>(++sequence_),
                  (Duration{now_.ns}.seconds() - left_before) * 1e3, vx, wz);
    send_text(client, text);
  }
  /// Drives `robot` with the dead-man released.
  void drive(RecordingClient& client, const std::string& robot = "trainee") {
    send_text(client, R"({"type":"drive","robot":")" + robot + "\"}");
    send_text(client, R"({"type":"release"})");
    discard_published();
  }
  void pass(double s) {
    for (const WallTime end = now_ + seconds(s); now_ < end;) {
      now_ = std::min(end, now_ + milliseconds(20));
      service_->turn();
    }
  }
  /// Messages published since the last call, by channel; of twists vx. Also updates last_, orders_ and
  /// statuses_.
  std::map<std::string, std::vector<double>> published() {
    std::map<std::string, std::vector<double>> all;
    Message message;
    while (true) {
      const auto received = server_->receive(message, Duration{0});
      if (!received.ok() || !*received) return all;
      TwistCommand command;
      if (message.channel.ends_with("TELEOP")) {
        EXPECT_TRUE(decode(message.channel, message.payload, command).ok());
        all[message.channel].push_back(command.twist.vx);
        last_ = command.twist;
      } else if (message.channel == channel::kJointCmd) {
        Joints joints;
        EXPECT_TRUE(decode(message.channel, message.payload, joints).ok());
        all[message.channel].push_back(joints.velocities.at(0));
      } else if (message.channel == channel::kMrEmergencyStop) {
        EmergencyStopCommand order;
        EXPECT_TRUE(decode(message.channel, message.payload, order).ok());
        orders_.push_back(order);
      } else {
        OperatorStatus status;
        EXPECT_TRUE(decode(message.channel, message.payload, status).ok());
        statuses_.push_back(status);
      }
    }
  }
  /// The next published() returns only what is published after this.
  void discard_published() { published(); }
  static bool moves(const std::vector<double>& speeds) {
    return std::any_of(speeds.begin(), speeds.end(), [](double v) { return v != 0; });
  }

  MemoryBusHub hub_;
  std::unique_ptr<Bus> service_bus_, server_;
  WallTime now_{1'000'000'000};
  std::vector<std::string> audited_;
  std::vector<EmergencyStop> stops_;
  std::vector<OperatorStatus> statuses_;
  std::vector<EmergencyStopCommand> orders_;
  Twist2 last_;
  std::uint64_t clients_ = 0, sequence_ = 0;
  std::unique_ptr<TeleopService> service_;
  SocketHandler handler_{
      [this](std::shared_ptr<WebClient> c) { service_->socket().opened(c); },
      [this](WebClient& c, std::string_view b, bool is) { service_->socket().received(c, b, is); },
      [this](WebClient& c) { service_->socket().closed(c); }};
};

}  // namespace parhelion::station
