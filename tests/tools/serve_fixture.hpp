// `parhelion serve` as a process: its scenario, its arguments, and a bus to talk to it.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "server/runtime/wall_clock.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::test {

/// A scenario with a room and a robot, and the robot's end of the bus of `parhelion serve`.
class ServeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "model.yaml") << to_yaml(room());
    std::ofstream(folder_ / "robot.yaml") << to_yaml(robot());
    Scenario scenario;
    scenario.name = "kill";
    scenario.model = "model.yaml";
    scenario.robot = "robot.yaml";
    std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
    auto bus = open_network_bus(url_);
    ASSERT_TRUE(bus.ok()) << bus.error().message;
    bus_ = std::move(*bus);
    ASSERT_TRUE(bus_->subscribe("MR_.*", 2000).ok());
  }
  std::vector<std::string> serve(const std::string& session) {
    return {"serve",
            folder_ / "scenario.yaml",
            "-o",
            folder_ / session,
            "--url",
            url_,
            "--no-restart",
            "--force",
            "--state-folder",
            folder_ / "state"};
  }
  Message spawn(std::uint64_t request, int place) {
    AgentSpawn command{.stamp = {runtime::wall_now().ns}, .request = request};
    command.agent = agent("box_" + std::to_string(request), AgentKind::box, -4.0 + 0.9 * (place % 10),
                          -3.0 + 0.9 * (place / 10 % 7));
    return message(channel::kMrSpawn, 0, command);
  }
  /// The next reply to a command; 0: none in time.
  std::uint64_t answer(Duration timeout) {
    const WallTime deadline = runtime::steady_now() + timeout;
    Message message;
    while (runtime::steady_now() < deadline) {
      const auto received = bus_->receive(message, deadline - runtime::steady_now());
      if (!received.ok() || !*received) break;
      Event event;
      if (message.channel != channel::kMrEvents || !decode(message.channel, message.payload, event)) continue;
      if (event.kind == EventKind::command_accepted || event.kind == EventKind::command_refused)
        return event.request;
    }
    return 0;
  }
  /// Waits until the server replies.
  ::testing::AssertionResult await_server(Process& server, std::uint64_t request) {
    const Message hello = spawn(request, 0);
    for (int tries = 0; tries < 200; ++tries) {
      if (!server.running()) return ::testing::AssertionFailure() << bytes_of(folder_ / "serve.txt");
      EXPECT_TRUE(bus_->publish(hello.channel, hello.payload).ok());
      if (answer(milliseconds(100)) == request) return ::testing::AssertionSuccess();
    }
    return ::testing::AssertionFailure() << "no answer: " << bytes_of(folder_ / "serve.txt");
  }
  /// Sends the robot's emergency stop until the server has replied.
  ::testing::AssertionResult emergency_stop(bool engaged, std::uint64_t request) {
    const EmergencyStopCommand command{.request = request, .robot = robot().name, .engaged = engaged};
    const Message message = test::message(channel::kMrEmergencyStop, 0, command);
    for (int tries = 0; tries < 50; ++tries) {
      if (!bus_->publish(message.channel, message.payload)) break;
      for (std::uint64_t answered = answer(milliseconds(400)); answered != 0;
           answered = answer(milliseconds(400)))
        if (answered == request) return ::testing::AssertionSuccess();
    }
    return ::testing::AssertionFailure() << "no answer: " << bytes_of(folder_ / "serve.txt");
  }
  /// The reason why the server limits the robot's command.
  std::string why_reduced() {
    Message message;
    Event event;
    for (int tries = 0; tries < 200; ++tries) {
      const Message drive =
          test::message(channel::kTeleop, 0, TwistCommand{{runtime::wall_now().ns}, {0, 0, 0.3}});
      (void)bus_->publish(drive.channel, drive.payload);
      for (auto came = bus_->receive(message, milliseconds(50)); came && *came;
           came = bus_->receive(message, milliseconds(50))) {
        if (message.channel == channel::kMrEvents && decode(message.channel, message.payload, event).ok() &&
            event.kind == EventKind::speed_limited)
          return event.text;
      }
    }
    return "";
  }
  /// The server itself is the only child of its supervising process. 0: none.
  static pid_t child_of(const Process& server) { return test::child_of(server.pid()); }
  std::set<std::uint64_t> commands_in(const std::string& session) {
    std::set<std::uint64_t> requests;
    auto reader = LogReader::open(folder_ / session);
    EXPECT_TRUE(reader.ok());
    while (reader.ok()) {
      const auto next = reader->next();
      if (!next.ok()) continue;
      if (!*next) break;
      AgentSpawn command;
      if ((*next)->channel == channel::kMrSpawn && decode((*next)->channel, (*next)->payload, command).ok()) {
        requests.insert(command.request);
      }
    }
    return requests;
  }

  TemporaryFolder folder_;
  std::unique_ptr<Bus> bus_;

 private:
  /// A server of the test before may still be ending.
  static int next_group() {
    static int tests = 0;
    return 100 + tests++ % 100;
  }

 protected:
  const std::string url_ = bus_url(next_group());
};

}  // namespace parhelion::test
