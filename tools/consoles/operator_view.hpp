// State that a console displays: robots, the server's response to commands, and events.
#pragma once

#include <map>
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
  /// Of a trainee's robot, from its JOINT_STATE.
  std::vector<std::string> joints(const std::string& robot) const { return of(robot, joints_); }
  /// MR_CMD: the command sent to a trainee's robot.
  Twist2 command(const std::string& robot) const { return of(robot, commands_); }
  /// Events since the last call, one line each, without continued contacts.
  std::vector<std::string> take_news();

 private:
  void take(const Message& message);

  Bus& bus_;
  std::vector<station::DrivenRobot> robots_;
  // By the robot's name in its channels; empty: there is one robot.
  template <class T>
  using ByRobot = std::map<std::string, T, std::less<>>;
  template <class T>
  static T of(const std::string& robot, const ByRobot<T>& all) {
    const auto found = all.find(robot), bare = all.find("");
    return found != all.end() ? found->second : bare != all.end() ? bare->second : T{};
  }
  ByRobot<std::vector<std::string>> joints_;
  ByRobot<Twist2> commands_;
  std::vector<std::string> news_;
};

}  // namespace parhelion::tools
