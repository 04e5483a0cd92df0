// Maps the sticks and buttons of a console to commands: pure functions of its state.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/status.hpp"

namespace parhelion::station {

struct MappedAxis {
  std::string axis;  ///< "leftx", or "axis 2"; empty: none
  bool invert = false;
};

struct MappedJoint {
  std::string joint;
  double speed = 0;      ///< rad/s or m/s at a full stick, or while a button is held
  MappedAxis axis;       ///< and/or...
  std::string up, down;  ///< ...buttons
};

/// Read from YAML (schema joystick.schema.json).
struct JoystickMapping {
  std::string device;  ///< part of its name; empty: any
  std::string dead_man;
  double dead_zone = 0.12;  ///< fraction of a stick's range
  double curve = 1.5;       ///< exponent beyond it
  double rate = 20;         ///< Hz
  double speed = 0.8;       ///< m/s at a full stick
  double yaw_rate = 1.2;    ///< rad/s
  MappedAxis forward, left, turn;
  std::string slow;        ///< button: reduces all speeds to a third
  std::string next_robot;  ///< button
  std::vector<MappedJoint> joints;
};

/// Errors contain file and line.
Result<JoystickMapping> parse_joystick_mapping(const std::string& yaml, const std::string& origin);
/// A shipped mapping by its name (server/station/console/mappings), or the path of a YAML file.
Result<JoystickMapping> load_joystick_mapping(const std::string& name_or_path);
std::vector<std::string> shipped_joystick_mappings();
/// For a game controller that SDL supports: left stick drives and turns, left shoulder is the dead-man.
JoystickMapping default_joystick_mapping();

/// State of a device at an instant: axes in [-1, 1] and buttons by name ("axis 0", "button 0", and SDL's
/// names if it is a known game controller).
struct JoystickState {
  std::map<std::string, double> axes;
  std::map<std::string, bool> buttons;
};

/// Error: the mapping uses an axis or a button that the device lacks; the message lists those that it has.
Status check_mapping(const JoystickMapping& mapping, const JoystickState& device);

/// 0 within the dead zone, 1 at the end, |.|^curve between; odd in x. NaN: 0.
double shaped(double x, double dead_zone, double curve);

struct JoystickCommand {
  bool armed = false;  ///< the dead-man is held; otherwise everything is zero
  Twist2 twist;
  std::vector<double> joints;  ///< speeds, one for each joint of the mapping
  bool next_robot = false;     ///< the button has just been pressed
};

/// State of one device since it was plugged in. The dead-man counts only after it was seen released since
/// then and since restart(), so that no robot starts to move by itself.
class JoystickDrive {
 public:
  explicit JoystickDrive(JoystickMapping mapping) : mapping_(std::move(mapping)) {}
  JoystickCommand command(const JoystickState& state);
  void restart() { seen_released_ = false; }
  const JoystickMapping& mapping() const { return mapping_; }

 private:
  JoystickMapping mapping_;
  bool seen_released_ = false;
  bool next_was_down_ = true;
};

}  // namespace parhelion::station
