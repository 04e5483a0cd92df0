// Checks whether the time limits of the tasks can be met.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "server/tick/configuration.hpp"

namespace parhelion::tick {

struct ShortLimit {
  std::size_t task = 0;  ///< index in the training
  std::string text;      ///< its limit, the distance and the robot's speed
};

/// Tasks whose limit is shorter than the straight path to their zones takes at the robot's speed limit. A
/// path begins at the start of a simulated robot, or in the zone of the task before. Every real path is
/// longer, so other limits may be too short as well.
std::vector<ShortLimit> short_limits(const Configuration& configuration);

}  // namespace parhelion::tick
