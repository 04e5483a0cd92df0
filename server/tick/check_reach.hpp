// Whether the zones that tasks ask for can be reached at all.
#pragma once

#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// For each zone that a task is to reach: there is room in it for the robot's base, and, where the start is
/// known (levels 1 and 2) and lies on the same floor, a way to it. Doors count as open. Error: the first that
/// is not so. Takes a while on a large site: for who checks a file.
Status check_reach(const Configuration& configuration);

}  // namespace parhelion::tick
