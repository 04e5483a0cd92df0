// Places in messages and events.
#pragma once

#include <Eigen/Core>
#include <string>

namespace parhelion::simulation {

/// "(1.00, 2.50)", of m in the map.
std::string place_text(const Eigen::Vector2d& p);

}  // namespace parhelion::simulation
