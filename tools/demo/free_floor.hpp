// Free space for a robot on a grid map.
#pragma once

#include <Eigen/Core>

#include "fusion/pose/maps/grid_map.hpp"

namespace parhelion::tools {

/// True if every cell that touches the square of this half side (m) around `at` (m, map) is known to be free.
bool is_free(const pose::GridMap& map, const Eigen::Vector2d& at, double radius);

}  // namespace parhelion::tools
