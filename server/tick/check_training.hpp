// Whether a scenario's training fits its model, robot and agents.
#pragma once

#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// Zones, doors, flights, agents that the training names and that are not there; a camera that it needs.
/// Error: the first, with the nearest name.
Status check_training(const Configuration& configuration);

}  // namespace parhelion::tick
