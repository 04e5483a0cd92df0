// Re-weighs wall candidates by their neighbours: furniture that looks like a wall is recognised by what is
// beside and behind it.
// Internal to the semantic net.
#pragma once

#include <vector>

#include "fusion/semantic/net/wall_candidates.hpp"

namespace parhelion::semantic {

/// Lowers the scores of arcs that are not measured over their height, of short pieces that join no wall, of
/// fronts of what stands before a wall, and of stubs.
void weigh_walls(std::vector<WallCandidate>& walls);

}  // namespace parhelion::semantic
