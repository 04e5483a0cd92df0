// What the server learns from a real scan, after it was answered: whether it contradicts the robot
// description, whether the laser shows virtual objects, where people and other real obstacles stand, and how
// far doors are open.
#pragma once

#include "server/simulation/simulation.hpp"
#include "server/tick/scan_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// `poses`: read only where the outcome says that they are known.
void learn_from_scan(const TickContext& context, const ScanOutcome& outcome, const SweepPoses& poses,
                     const ScanPath& path);

/// At each step: removes obstacles that no scan has shown for a while.
void forget_old_obstacles(const TickContext& context, ScanState& scan, simulation::Simulation& simulation);

}  // namespace parhelion::tick
