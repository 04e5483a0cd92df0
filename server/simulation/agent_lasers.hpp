// Agents' own lasers: when a scan is due, and which obstacles it shows.
#pragma once

#include <vector>

#include "protocols/scan.hpp"
#include "protocols/status.hpp"
#include "server/simulation/agents.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::simulation {

/// The laser of the agent's definition, if it has one; the first scan is due at `now`. Error: no such laser,
/// or an agent that carries none.
Status fit_laser(Agent& agent, SimulationTime now);

/// Appends a request for each scan that is due at `now`.
void request_scans(Agents& agents, SimulationTime now, std::vector<LaserRequest>& requests);

/// The scan that was requested last: the nearest return of each sector of 4 degrees becomes an obstacle of
/// the agent's behaviour.
void handle_scan(AgentLaser& laser, const Scan& scan);

}  // namespace parhelion::simulation
