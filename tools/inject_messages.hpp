// Converts the arguments of `parhelion inject` to a message.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/instructor_command.hpp"
#include "protocols/status.hpp"
#include "tools/bus_options.hpp"

namespace parhelion::tools {

struct InjectArguments {
  std::string action, name, kind = "box", at, size, behaviour = "stay", laser, model, target, channel, side;
  BusOptions bus;
  std::vector<std::string> waypoints;
  double speed = 0.5, distance = 1.5;  ///< m/s; m from the target
  double timeout = 4.0;                ///< s; a server that is behind refuses a command after kMaxCommandAge
  std::optional<double>
      amount;  ///< of a fault: s of camera_delay, the lost fraction of camera_loss and laser_dropouts
  std::optional<double> rate;     ///< pictures per second
  std::optional<double> opening;  ///< rad, of a door; none: as the sensors see it
  double lasting = 0;             ///< s, of a fault; 0: until end-fault
  bool yields = false, leaves_doors = false;
};

/// Valid values of `action`.
std::vector<std::string> inject_actions();
/// With the current stamp and a new request number. The caller fills in the pose of a reset. The error
/// contains the option that is missing or invalid. `action`, `kind` and `behaviour` must be valid.
Result<InstructorCommand> make_command(const InjectArguments& arguments);

}  // namespace parhelion::tools
