// Joysticks and game pads through SDL2, with hot plugging.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "server/station/console/joystick_mapping.hpp"

namespace parhelion::station {

struct JoystickName {
  std::string name;
  bool game_controller = false;  ///< SDL has names for its sticks and buttons
  int axes = 0, buttons = 0;
};

/// One per process, used on one thread.
class JoystickPort {
 public:
  /// Error: SDL's reason.
  static Result<std::unique_ptr<JoystickPort>> open();
  ~JoystickPort();
  JoystickPort(const JoystickPort&) = delete;
  JoystickPort& operator=(const JoystickPort&) = delete;

  /// All devices that are plugged in now.
  std::vector<JoystickName> list();
  /// Reads the devices. Returns the state of the device whose name contains `name` (empty: the first device);
  /// nullopt: not plugged in. A device stays in use until it is unplugged.
  std::optional<JoystickState> poll(const std::string& name);
  /// Name of the device in use, or empty.
  std::string in_use() const;

 private:
  struct State;
  explicit JoystickPort(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::station
