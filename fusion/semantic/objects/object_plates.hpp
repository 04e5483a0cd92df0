// Level tops of things: table tops, seats, counters, mattresses. Internal to the objects.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/semantic/objects/object_grid.hpp"

namespace parhelion::semantic {

struct ObjectPlate {
  std::vector<std::uint32_t> cubes;
  double z = 0, height = 0;  ///< m, of its points; over the floor
  double area = 0;           ///< m^2
  double sides = 0;          ///< fraction of its rim under which something reaches down to the floor
};

/// Cubes with free space over them that join level; of at least `min_area` m^2.
std::vector<ObjectPlate> find_plates(const ObjectGrid& grid, double min_area);

}  // namespace parhelion::semantic
