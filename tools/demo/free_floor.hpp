// Where a robot has room on a grid map.
#pragma once

#include <Eigen/Core>

#include "fusion/pose/slam.hpp"

namespace parhelion::tools {

/// Whether every cell that touches the square of this half side (m) around `at` (m, map) is known to be free.
bool is_free(const pose::GridMap& map, const Eigen::Vector2d& at, double radius);

}  // namespace parhelion::tools
