// Supervision (paper 4.1): after each step, what robots and agents do and what happens to them becomes
// events.
#pragma once

#include <vector>

#include "server/simulation/contacts.hpp"
#include "server/simulation/predictor.hpp"
#include "server/simulation/surroundings.hpp"

namespace parhelion::simulation {

/// Of all of `around`, whose real_robots and agents are those given: their watches and predictions, radio and
/// battery.
void supervise(RealRobots& real_robots, Agents& agents, const Surroundings& around, const Contacts& contacts,
               const Physics& physics, Predictor& predictor, std::vector<Event>& events);

}  // namespace parhelion::simulation
