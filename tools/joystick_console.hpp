// A joystick as a console: from what is plugged in to what the operator says on the bus.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "protocols/time.hpp"
#include "server/hmi/joystick_device.hpp"
#include "server/hmi/operator_console.hpp"
#include "tools/operator_view.hpp"

namespace parhelion {

struct JoystickConsoleOptions {
  std::string robot;                            ///< whom to drive at the start; empty: the trainee's
  std::string name = "operator";                ///< of the operator
  std::function<void(const std::string&)> say;  ///< news for a person
};

/// Polled some hundred times a second, on one thread.
class JoystickConsole {
 public:
  JoystickConsole(JoystickConsoleOptions options, JoystickMapping mapping, Bus& bus, JoystickPort& port);

  /// Subscribes to what it has to know: which robots there are.
  Status listen() { return view_.listen(); }
  /// Reads the stick and says what is due. `now`: steady clock; `stamp`: what the messages say. Error: the
  /// bus, or a device that has not what the mapping names.
  Status turn(WallTime now, SensorTime stamp);
  /// Stops the robot and says that the operator has ended.
  Status end(SensorTime stamp) { return console_.end(stamp); }

  const OperatorView& view() const { return view_; }
  const DrivenRobot* driven() const { return console_.driven(); }

 private:
  Status unplugged(SensorTime stamp);
  Status choose(bool next, SensorTime stamp);
  Status send(const JoystickCommand& command, WallTime now, SensorTime stamp);
  void say(const std::string& line) const;

  const JoystickConsoleOptions options_;
  JoystickPort& port_;
  OperatorView view_;
  OperatorConsole console_;
  JoystickDrive drive_;
  Duration period_;
  std::vector<std::string> joints_;
  std::string last_robot_;
  bool plugged_ = false, waiting_ = false, armed_ = false;
  WallTime sent_, armed_until_;
};

}  // namespace parhelion
