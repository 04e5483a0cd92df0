// Checks that what a scenario names is there.
#pragma once

#include "protocols/status.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// Doors of `doors:` must be doors of the model; while a map grows, any name may come. Targets that agents
/// and scripts follow, flee or block must be robots or agents, spawned by scripts too; they
/// are not checked where the one real robot is named by its description on the bus. The error names the
/// door, agent or script, and a similar name.
Status check_names(const Configuration& configuration);

}  // namespace parhelion::tick
