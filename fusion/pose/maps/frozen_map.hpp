// A map that localization does not change, from a .simplemap or a ROS map.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fusion/pose/maps/grid_map.hpp"
#include "fusion/pose/maps/known_space.hpp"
#include "fusion/pose/maps/mapped_scan.hpp"
#include "fusion/pose/matching/correlative.hpp"
#include "fusion/pose/matching/surfel_map.hpp"
#include "protocols/status.hpp"

namespace parhelion::pose {

struct FrozenMap {
  GridMap grid;
  SurfelMap fine{0.1}, coarse{0.4};
  CorrelativeMap likelihood{{}, 0.1, 1};  ///< for searches near an expected pose
  CorrelativeMap rough{{}, 0.2, 1};       ///< for searches everywhere
  KnownSpace known;
  double sigma = 0.01;  ///< m, accuracy of its surfaces
  double bias = 0;      ///< m, 1 sigma: common error of neighbouring surfaces, due to the cell size
};

/// `resolution`: m, of its grid. The grid is left out where that is 0.
FrozenMap frozen_map_of(std::span<const MappedScan> scans, double resolution);

/// The id of a .simplemap is that of the ROS map beside it (PREFIX.yaml) where there is one, as written by
/// `slam --save-map`; else that of its grid at `resolution`.
Result<FrozenMap> load_frozen_map(const std::string& path, double resolution);

}  // namespace parhelion::pose
