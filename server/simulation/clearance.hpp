// Distance that a footprint can travel along an arc until it touches an agent.
#pragma once

#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::simulation {

/// See Simulation::clearance(), for a robot with the footprint `local` (in base_link). `held`: an agent that
/// does not count. `placed`: reused memory.
Simulation::Clearance clearance(const Footprint& local, const Agents& agents, const std::string& held,
                                const Transform<Map, Base>& T_map_base, const Twist2& twist, double limit,
                                Footprint& placed);

}  // namespace parhelion::simulation
