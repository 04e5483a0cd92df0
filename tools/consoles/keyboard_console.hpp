// A keyboard as a console: converts terminal input to operator messages on the bus.
#pragma once

#include <string>
#include <string_view>

#include "protocols/time.hpp"
#include "server/station/console/keyboard.hpp"
#include "server/station/console/operator_console.hpp"
#include "tools/consoles/operator_view.hpp"

namespace parhelion::tools {

struct KeyboardConsoleOptions {
  std::string robot;              ///< robot to drive at the start; empty: the trainee's
  std::string name = "operator";  ///< of the operator
  station::KeyboardOptions keys;
};

/// For one thread.
class KeyboardConsole {
 public:
  KeyboardConsole(const KeyboardConsoleOptions& options, Bus& bus);

  /// Subscribes to the lists of robots and joints.
  Status listen() { return view_.listen(); }
  /// Processes typed bytes (empty: none for a while) and sends due messages. `now`: steady clock; `stamp`: of
  /// the messages. Error: the bus, or no such robot.
  Status turn(std::string_view bytes, WallTime now, SensorTime stamp);
  /// Stops the robot and reports that the operator has ended, or that the console was lost and why.
  Status end(SensorTime stamp) { return console_.end(stamp); }
  Status lose(const std::string& why, SensorTime stamp) { return console_.lose(why, stamp); }

  bool quit() const { return quit_; }
  /// True if the help key was pressed since the last call.
  bool take_help();
  /// The joint that r and f move; empty: none known yet.
  std::string driven_name() const;
  std::string joint() const;
  /// Status line: driven robot, command and selected joint.
  std::string line(WallTime now) const;
  OperatorView& view() { return view_; }
  const station::DrivenRobot* driven() const { return console_.driven(); }

 private:
  Status act(station::Key key, WallTime now, SensorTime stamp);
  Status choose(SensorTime stamp);
  Status send(WallTime now, SensorTime stamp);
  Status send_joint(double speed, SensorTime stamp);

  const KeyboardConsoleOptions options_;
  OperatorView view_;
  station::OperatorConsole console_;
  station::KeyReader reader_;
  station::KeyboardDrive keys_;
  bool quit_ = false, help_ = false, chosen_ = false, joint_moved_ = false;
  std::size_t joint_ = 0;
  std::string refused_;  ///< why the joint did not move
  WallTime moved_, last_;
};

}  // namespace parhelion::tools
