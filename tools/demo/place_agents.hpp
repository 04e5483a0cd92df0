// Places a demo's virtual robots beside the path of the real robot, on known free floor.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fusion/pose/maps/grid_map.hpp"
#include "protocols/agent.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

/// Three robots along `path` (x, y, yaw in the map): one that stands beside it and is approached head-on, one
/// that patrols along it, one that wanders with a laser of its own. Error: no free place of 0.6 m radius
/// within 2.5 m of the path.
Result<std::vector<AgentDefinition>> place_agents(const pose::GridMap& map,
                                                  const std::vector<Eigen::Vector3d>& path);

}  // namespace parhelion::tools
