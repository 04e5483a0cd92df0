// Plates that touch at one height are a surface. Internal to find_horizontals.cpp.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/semantic/surface_search.hpp"

namespace parhelion::semantic {

/// The order of plates: by y, then x, then z.
bool by_place(const Plate& a, const Plate& b);

/// Numbers the parts that touch; plates by place. Flat plates join; others belong to the flat one that is
/// next in height and join nothing: else floors would climb their walls, and treads run along them.
std::vector<std::uint32_t> join_plates(const std::vector<Plate>& plates);

}  // namespace parhelion::semantic
