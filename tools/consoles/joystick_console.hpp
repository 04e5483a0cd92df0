// A joystick as a console: converts its state to operator messages on the bus.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "protocols/time.hpp"
#include "server/station/console/joystick_device.hpp"
#include "server/station/console/operator_console.hpp"
#include "tools/consoles/operator_view.hpp"

namespace parhelion::tools {

struct JoystickConsoleOptions {
  std::string robot;                               ///< robot to drive at the start; empty: the trainee's
  std::string name = "operator";                   ///< of the operator
  std::function<void(const std::string&)> notify;  ///< messages for the operator
};

/// Polled some hundred times a second, on one thread.
class JoystickConsole {
 public:
  JoystickConsole(JoystickConsoleOptions options, station::JoystickMapping mapping, Bus& bus,
                  station::JoystickPort& port);

  /// Subscribes to the list of robots.
  Status listen() { return view_.listen(); }
  /// Reads the stick and sends due messages. `now`: steady clock; `stamp`: of the messages. Error: the bus,
  /// or a device without an axis or button that the mapping uses.
  Status turn(WallTime now, SensorTime stamp);
  /// Stops the robot and reports that the operator has ended.
  Status end(SensorTime stamp) { return console_.end(stamp); }

  const OperatorView& view() const { return view_; }
  const station::DrivenRobot* driven() const { return console_.driven(); }

 private:
  Status unplugged(SensorTime stamp);
  Status choose(bool next, SensorTime stamp);
  Status send(const station::JoystickCommand& command, WallTime now, SensorTime stamp);
  void notify(const std::string& line) const;

  const JoystickConsoleOptions options_;
  station::JoystickPort& port_;
  OperatorView view_;
  station::OperatorConsole console_;
  station::JoystickDrive drive_;
  Duration period_;
  std::vector<std::string> joints_;
  std::string last_robot_;
  bool plugged_ = false, waiting_ = false, armed_ = false;
  WallTime sent_, armed_until_;
};

}  // namespace parhelion::tools
