// Supervision (paper 4.1): after each step, detects events of robots and agents.
#pragma once

#include <vector>

#include "server/simulation/events/contacts.hpp"
#include "server/simulation/events/predictor.hpp"
#include "server/simulation/world/surroundings.hpp"

namespace parhelion::simulation {

/// For all robots and agents of `around`, which must be those given: updates watches and predictions, radio
/// and battery.
void supervise(RealRobots& real_robots, Agents& agents, const Surroundings& around, const Contacts& contacts,
               const Physics& physics, Predictor& predictor, std::vector<Event>& events);

}  // namespace parhelion::simulation
