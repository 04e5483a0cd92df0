// Tells flights of stairs from level things at rising heights. Internal to the semantic net.
#pragma once

#include <vector>

#include "fusion/semantic/net/find_stairs.hpp"
#include "fusion/semantic/net/levels.hpp"
#include "fusion/semantic/net/wall_raster.hpp"

namespace parhelion::semantic {

/// Drops flights that begin on no floor, landing or other flight, although the floor was measured where their
/// missing steps would stand; and short ones whose treads differ in depth.
void drop_floating(const PlanPoints& points, const Segmentation& segmentation, const Levels& levels,
                   std::vector<Flight>& flights);

}  // namespace parhelion::semantic
