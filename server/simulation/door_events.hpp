// What doors do, as events: opened and closed, broken off their hinges, who enters an opening and leaves it.
#pragma once

#include <vector>

#include "protocols/event.hpp"
#include "server/simulation/contact_tracker.hpp"
#include "server/simulation/door_set.hpp"
#include "server/simulation/surroundings.hpp"

namespace parhelion::simulation {

/// After a step. `doors`: those of around.environment; `touching`: all that touches in the step. A hinge that
/// was torn at too strongly breaks.
void watch_doors(DoorSet& doors, const std::vector<TouchingPair>& touching, const Surroundings& around,
                 Physics& physics, std::vector<Event>& events);

}  // namespace parhelion::simulation
