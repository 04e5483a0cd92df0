// Where a wall candidate is supported over its height. Internal to the semantic net.
#pragma once

#include <vector>

#include "fusion/semantic/net/wall_candidates.hpp"
#include "fusion/semantic/net/wall_cuts.hpp"

namespace parhelion::semantic {

/// The stretches of a wall that exist: measured over its height, or hidden between measured ones; never where
/// rays crossed its plane or pass over a low top, or, without viewpoints, where nothing is measured and
/// nothing stands in front. `kept`: openings that are doors and windows, or have a lintel; they do not end a
/// wall.
std::vector<WallStretch> supported_stretches(const WallCandidate& wall, const std::vector<Opening>& kept);

/// m of its length that is measured over its height, gaps left out.
double measured_length(const WallCandidate& wall);

}  // namespace parhelion::semantic
