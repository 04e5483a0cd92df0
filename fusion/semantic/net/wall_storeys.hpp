// Storeys of a wall that goes through several: each has its own doors and windows. Internal to the semantic
// net.
#pragma once

#include <vector>

#include "fusion/semantic/net/wall_candidates.hpp"

namespace parhelion::semantic {

/// Replaces each straight wall that stands in several storeys by one wall for each of them, with its floor,
/// ceiling and heights there: the lowest in its place, the others at the end. Only what is a wall as a whole:
/// the sides of flights are none. Returns the indices of these, which are to be measured anew.
std::vector<std::size_t> split_by_storey(const Segmentation& segmentation, const Levels& levels,
                                         std::vector<WallCandidate>& walls);

/// Whether both stand in one storey, by their floors and ceilings.
bool on_same_storey(const WallCandidate& a, const WallCandidate& b);

}  // namespace parhelion::semantic
