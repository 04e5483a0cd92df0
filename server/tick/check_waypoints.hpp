// Checks the waypoints of a scenario's agents against the building.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tick {

struct WrongWaypoint {
  std::size_t agent = 0, waypoint = 0;  ///< indices in the scenario
  std::string text;                     ///< the agent, the waypoint, its coordinates, and what is there
};

/// Waypoints inside a part of the building that no agent can enter. Those far outside the site are errors of
/// the start. Error: the model is no building.
Result<std::vector<WrongWaypoint>> wrong_waypoints(const Configuration& configuration);

}  // namespace parhelion::tick
