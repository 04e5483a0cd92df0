// Parts a site's loose cubes into things: what touches is one, but a table is lifted out of what stands
// around it, chairs part at their seats, and a row of furniture where its height changes. Internal to the
// objects.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/semantic/objects/object_grid.hpp"
#include "fusion/semantic/objects/object_plates.hpp"

namespace parhelion::semantic {

struct ObjectGroup {
  std::vector<std::uint32_t> cubes;  ///< ascending
  bool table = false;                ///< a plate on legs
};

std::vector<ObjectGroup> find_groups(const ObjectGrid& grid, const std::vector<ObjectPlate>& plates);

}  // namespace parhelion::semantic
