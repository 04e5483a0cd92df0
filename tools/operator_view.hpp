// What a console shows: which robots there are, what the server makes of the commands, and what happens.
#pragma once

#include <string>
#include <vector>

#include "server/station/console/operator_console.hpp"

namespace parhelion::tools {

class OperatorView {
 public:
  explicit OperatorView(Bus& bus) : bus_(bus) {}
  Status listen();
  /// Takes what has come; never waits.
  Status update();

  /// Of the newest MR_WORLD.
  const std::vector<station::DrivenRobot>& robots() const { return robots_; }
  /// Of the trainee's robot, as JOINT_STATE names them.
  const std::vector<std::string>& joints() const { return joints_; }
  /// MR_CMD: what goes to the trainee's robot.
  const Twist2& command() const { return command_; }
  /// Events since the last call, a line each; not of touches that go on.
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
