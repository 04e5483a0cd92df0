// Up to which height a wall's plane should be measured. Internal to the semantic net.
#pragma once

#include "fusion/semantic/net/wall_candidates.hpp"

namespace parhelion::semantic {

/// m, for a candidate whose raster is filled: its ceiling, but its own top of two kinds of wall that end
/// lower. Of a partition in a hall, beside which the floor goes on close to both sides; what is deeper than
/// 0.45 m is none, but a narrow bookcase is taken for one. And of a wall beyond which nothing was measured at
/// any height: the site ends there, however little of the wall was seen, from above or in a slice of heights.
/// So does a hollow thing of which the inside was not measured, where there is no ceiling over it.
double judged_top(const PlanPoints& points, const WallCandidate& wall);

}  // namespace parhelion::semantic
