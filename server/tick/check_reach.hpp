// Checks whether the zones of the tasks are reachable.
#pragma once

#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// For each zone that a task must reach: the robot's base fits into it and, where the start is known (levels
/// 1 and 2) and on the same floor, a route leads there. Doors count as open. Error: the first zone that
/// fails. Slow on a large site, so meant for checking a file.
Status check_reach(const Configuration& configuration);

}  // namespace parhelion::tick
