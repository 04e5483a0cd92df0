// Joysticks and game pads as SDL2 knows them, plugged in and out while they are used.
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
  bool game_controller = false;  ///< SDL knows its sticks and buttons by name
  int axes = 0, buttons = 0;
};

/// One a process, on one thread.
class JoystickPort {
 public:
  /// Error: SDL's reason.
  static Result<std::unique_ptr<JoystickPort>> open();
  ~JoystickPort();
  JoystickPort(const JoystickPort&) = delete;
  JoystickPort& operator=(const JoystickPort&) = delete;

  /// What is plugged in now.
  std::vector<JoystickName> list();
  /// Reads the devices. The state of the one whose name holds `name` (the first one where that is empty);
  /// nullopt: it is not plugged in. One that is in use stays in use until it is unplugged.
  std::optional<JoystickState> poll(const std::string& name);
  /// Of the one in use, or empty.
  std::string in_use() const;

 private:
  struct State;
  explicit JoystickPort(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::station
