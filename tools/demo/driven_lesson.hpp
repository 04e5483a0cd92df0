// What whoever opens the demo's page can drive and be graded on: a virtual robot beside the recorded one.
#pragma once

#include "fusion/pose/slam.hpp"
#include "protocols/scenario.hpp"

namespace parhelion::tools {

/// Turns the agent `robot` of the scenario to the longest run of free floor from where it stands, and adds a
/// zone at the end of it, of three metres at most, that is to be driven into. Error, and nothing is changed:
/// no run of 1.5 m, or no such agent.
Status add_driven_lesson(const pose::GridMap& map, const std::string& robot, Scenario& scenario);

}  // namespace parhelion::tools
