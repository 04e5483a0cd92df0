// Checks the channels of sensors that a robot has besides the first of their kind.
#pragma once

#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// Error: the scenario renames a channel of a laser or camera that no robot has, or two channels would have
/// one name on the bus.
Status check_sensor_channels(const Scenario& scenario, const SensorNames& sensors);

}  // namespace parhelion::tick
