// Updates a simulated robot's radio link and battery in a step, and reports their events.
#pragma once

#include <vector>

#include "server/simulation/robots/supply_state.hpp"
#include "server/simulation/world/surroundings.hpp"

namespace parhelion::simulation {

/// For an agent with a robot model, after a step.
void watch_radio(Agent& agent, const ObservedMotion& motion, const Surroundings& around,
                 std::vector<Event>& events);
void watch_battery(Agent& agent, const ObservedMotion& motion, const Surroundings& around,
                   const Physics& physics, std::vector<Event>& events);

/// nullptr, or an agent without a robot model: full supply.
SupplyState supply_state(const Agent* agent, const std::optional<Battery>& battery);

}  // namespace parhelion::simulation
