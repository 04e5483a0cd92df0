// How agents move in a step: what their motors and feet do before the physics, and where they are after it.
#pragma once

#include <vector>

#include "server/simulation/behaviour.hpp"
#include "server/simulation/surroundings.hpp"
#include "server/simulation/unconstrained_motion.hpp"

namespace parhelion::simulation {

/// Before the physics: upright agents go for what their behaviour asks for. `agents`: those of `around`.
void drive_agents(Agents& agents, const Surroundings& around, Behaviours& behaviours,
                  ContactForecast& forecast, Physics& physics, std::vector<Event>& events);

/// After the physics: poses, footprints and parts of all agents; appends events of joints that broke.
void observe_agents(Agents& agents, const StepClock& clock, Physics& physics, std::vector<Event>& events);

}  // namespace parhelion::simulation
