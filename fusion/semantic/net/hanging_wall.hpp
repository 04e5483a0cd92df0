// Upright surfaces that hang over the floor. Internal to the semantic net.
#pragma once

#include "fusion/semantic/net/wall_candidates.hpp"

namespace parhelion::semantic {

/// Whether a measured wall ends over the floor, which goes on under it: a curtain, a sign, a beam.
bool hangs(const PlanPoints& points, const WallCandidate& wall);

}  // namespace parhelion::semantic
