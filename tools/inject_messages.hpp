// From the arguments of `parhelion inject` to the message that it sends.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/instructor_command.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

struct InjectArguments {
  std::string action, name, kind = "box", at, size, behaviour = "stay", laser, model, target, url, channel,
                            side;
  std::vector<std::string> waypoints;
  double speed = 0.5, distance = 1.5, timeout = 2.0;
  std::optional<double> amount, rate, opening;
  double lasting = 0;
  bool yields = false, leaves_doors = false;
};

/// What `action` may be.
std::vector<std::string> inject_actions();
/// With the stamp of now and a request of its own. The place of a reset is left for the caller to fill in.
/// Error: what is missing or wrong, by its option; `action`, `kind` and `behaviour` must be known ones.
Result<InstructorCommand> make_command(const InjectArguments& arguments);

}  // namespace parhelion::tools
