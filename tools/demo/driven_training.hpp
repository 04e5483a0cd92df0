// A driving task for users of the demo's page: a virtual robot beside the recorded one.
#pragma once

#include "fusion/pose/maps/grid_map.hpp"
#include "protocols/scenario.hpp"

namespace parhelion::tools {

/// Turns the agent `robot` of the scenario towards the longest run of free floor from its position, and adds
/// a target zone at the end of it, at most three metres away. Error, with nothing changed: no run of 1.5 m,
/// or no such agent.
Status add_driven_training(const pose::GridMap& map, const std::string& robot, Scenario& scenario);

}  // namespace parhelion::tools
