// Motion of agents in a step: motor and gait commands before the physics, observation after it.
#pragma once

#include <vector>

#include "server/simulation/behaviour/behaviour.hpp"
#include "server/simulation/world/surroundings.hpp"
#include "server/simulation/world/unconstrained_motion.hpp"

namespace parhelion::simulation {

/// Before the physics: drives upright agents as their behaviour requests. `agents`: those of `around`.
void drive_agents(Agents& agents, const Surroundings& around, Behaviours& behaviours,
                  ContactForecast& forecast, Physics& physics, std::vector<Event>& events);

/// After the physics: updates poses, footprints and parts of all agents; appends events of broken joints.
void observe_agents(Agents& agents, const StepClock& clock, Physics& physics, std::vector<Event>& events);

}  // namespace parhelion::simulation
