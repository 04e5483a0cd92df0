// Checks a scenario's training against its model, robot and agents.
#pragma once

#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// Checks that the zones, doors, flights of stairs and agents named by the training exist, and the camera
/// that it needs. Error: the first that is missing, with the nearest name.
Status check_training(const Configuration& configuration);

}  // namespace parhelion::tick
