// Events of doors: opened, closed, broken off their hinges, opening entered and left.
#pragma once

#include <vector>

#include "protocols/event.hpp"
#include "server/simulation/bodies/contact_tracker.hpp"
#include "server/simulation/world/door_set.hpp"
#include "server/simulation/world/surroundings.hpp"

namespace parhelion::simulation {

/// After a step. `doors`: those of around.environment; `touching`: all contacts of the step. Overloaded
/// hinges break.
void watch_doors(DoorSet& doors, const std::vector<TouchingPair>& touching, const Surroundings& around,
                 Physics& physics, std::vector<Event>& events);

}  // namespace parhelion::simulation
