// State that a console displays: robots, the server's response to commands, and events.
#pragma once

#include <string>
#include <vector>

#include "server/station/console/operator_console.hpp"

namespace parhelion::tools {

class OperatorView {
 public:
  explicit OperatorView(Bus& bus) : bus_(bus) {}
  Status listen();
  /// Processes received messages; never waits.
  Status update();

  /// Of the newest MR_WORLD.
  const std::vector<station::DrivenRobot>& robots() const { return robots_; }
  /// Of the trainee's robot, from JOINT_STATE.
  const std::vector<std::string>& joints() const { return joints_; }
  /// MR_CMD: the command sent to the trainee's robot.
  const Twist2& command() const { return command_; }
  /// Events since the last call, one line each, without continued contacts.
  std::vector<std::string> take_news();

 private:
  void take(const Message& message);

  Bus& bus_;
  std::vector<station::DrivenRobot> robots_;
  std::vector<std::string> joints_;
  std::vector<std::string> news_;
  Twist2 command_;
};

}  // namespace parhelion::tools
