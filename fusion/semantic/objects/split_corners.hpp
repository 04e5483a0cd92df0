// Parts things that meet at a corner. Internal to the objects.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/semantic/objects/object_grid.hpp"

namespace parhelion::semantic {

/// A row of counters around a corner of a room, or two sofas there, are one group of cubes whose box is
/// mainly empty: cuts it into the pieces whose boxes together are smallest. Thin pieces stay together: two
/// faces of one thing.
std::vector<std::vector<std::uint32_t>> split_corners(const ObjectGrid& grid,
                                                      std::vector<std::uint32_t> cubes);

}  // namespace parhelion::semantic
