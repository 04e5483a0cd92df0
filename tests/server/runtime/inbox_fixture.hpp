// An inbox on a bus in memory, and a robot that sends to it.
#pragma once

#include <gtest/gtest.h>

#include "server/runtime/inbox.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::runtime {

inline tick::Configuration robots_named(const std::vector<std::string>& names) {
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

}  // namespace parhelion::runtime
