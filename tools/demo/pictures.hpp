// The demo's map picture: all paths, and one augmented scan.
#pragma once

#include <string>

#include "fusion/pose/maps/grid_map.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"
#include "tools/demo/witness.hpp"

namespace parhelion::tools {

/// PNG: grid map, walls, the paths of the robot and of each agent, the bodies and the scan of the recorded
/// moment.
Status draw_map_picture(const std::string& path, const pose::GridMap& map, const SemanticModel& model,
                        const Witness& witness);

}  // namespace parhelion::tools
