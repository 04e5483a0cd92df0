// Cuts a cloud at the height of a laser: the 2D map that a robot there would have made.
#pragma once

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/pose/maps/grid_map.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

struct SliceOptions {
  double height = 0.3;           ///< m over `floor`, of the laser
  double band = 0.1;             ///< m, half width: points this near to the laser's plane count
  double resolution = 0.05;      ///< m, of a cell
  double floor = 0;              ///< m, z of the floor
  std::uint32_t min_points = 2;  ///< minimum in an occupied cell
  /// m from their scanner: nearer points are of what carries it. Chosen on 3d-3dtk-corridor, whose robot
  /// returns at 0.1 to 0.2 m.
  double min_range = 0.3;
};

/// Occupied: cells with points in the band. Free: cells that a line of sight (viewpoint to point) crosses
/// within the band, and cells whose floor was measured with nothing in the band. All others are unknown. Its
/// id is left empty. Errors: no point in the band, options out of range, a map of more than 1e8 cells.
Result<pose::GridMap> slice(const cloud::PointCloud<Map>& cloud, const SliceOptions& options = {});

}  // namespace parhelion::semantic
