// Joins plates that touch at one height to surfaces. Internal to find_horizontals.cpp.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/semantic/segmentation/surface_search.hpp"

namespace parhelion::semantic {

/// The order of plates: by y, then x, then z.
bool by_place(const Plate& a, const Plate& b);

/// Numbers the connected components; plates sorted by place. Flat plates join; others are assigned to the
/// adjacent flat plate nearest in height and join nothing: otherwise floors would climb their walls, and
/// treads would run along them. Nor do plates on a ramp between floors. `cell`: m, side of a plate.
std::vector<std::uint32_t> join_plates(const std::vector<Plate>& plates, double cell);

}  // namespace parhelion::semantic
