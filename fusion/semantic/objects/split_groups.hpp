// Parts what touches into things. Internal to the objects.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/semantic/objects/object_grid.hpp"
#include "fusion/semantic/objects/object_plates.hpp"

namespace parhelion::semantic {

/// Chairs part at their seats, rows of furniture where their height changes and at corners.
std::vector<std::vector<std::uint32_t>> split_groups(const ObjectGrid& grid,
                                                     const std::vector<ObjectPlate>& plates,
                                                     std::vector<std::vector<std::uint32_t>> groups);

}  // namespace parhelion::semantic
