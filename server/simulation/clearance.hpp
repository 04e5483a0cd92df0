// How far a footprint can go along an arc until it touches an agent.
#pragma once

#include "server/simulation/agents.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::simulation {

/// As Simulation::clearance(), of a robot with the footprint `local` (in base_link). `placed`: memory that is
/// used again.
Simulation::Clearance clearance(const Footprint& local, const Agents& agents,
                                const Transform<Map, Base>& T_map_base, const Twist2& twist, double limit,
                                Footprint& placed);

}  // namespace parhelion::simulation
