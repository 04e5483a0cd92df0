// Lengths and angles of a robot description that look like another unit.
#pragma once

#include <string>
#include <vector>

#include "protocols/robot.hpp"

namespace parhelion::tools {

/// One sentence for each value that no mobile robot has: key, value, and the likely cause. Footprint, height,
/// the positions of lasers and what their beams cover count.
std::vector<std::string> implausible_values(const RobotDescription& robot);

}  // namespace parhelion::tools
