// Lengths of a robot description that look like another unit.
#pragma once

#include <string>
#include <vector>

#include "protocols/robot.hpp"

namespace parhelion::tools {

/// One sentence for each length that no mobile robot has: key, value, and the likely cause. Footprint, height
/// and the positions of lasers count.
std::vector<std::string> implausible_lengths(const RobotDescription& robot);

}  // namespace parhelion::tools
