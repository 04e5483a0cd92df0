// Agents' own lasers: when a scan is due, and the obstacles from it.
#pragma once

#include <vector>

#include "protocols/scan.hpp"
#include "protocols/status.hpp"
#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::simulation {

/// Fits the laser of the agent's definition, if any; the first scan is due at `now`. Error: an unknown laser,
/// or an agent that cannot carry one.
Status fit_laser(Agent& agent, SimulationTime now);

/// Appends a request for each scan that is due at `now`.
void request_scans(Agents& agents, SimulationTime now, std::vector<LaserRequest>& requests);

/// Processes the last requested scan: the nearest return of each 4-degree sector becomes an obstacle for the
/// agent's behaviour.
void handle_scan(AgentLaser& laser, const Scan& scan);

}  // namespace parhelion::simulation
