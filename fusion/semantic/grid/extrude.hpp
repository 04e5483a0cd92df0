// Extrudes walls as boxes from a 2D grid map, so that a site with only planar scans has a semantic model.
//
// Straight walls: greedy Hough transform over the occupied cells (Duda and Hart 1972), each peak refined by
// total least squares over its longest run; cells covered by a box no longer vote. The remaining cells
// (clutter, legs, round objects) become small upright boxes labelled unknown, so that each occupied cell is
// inside a box. The exception are specks out of any robot's reach, which lasers leave by the hundred behind
// windows and doors.
#pragma once

#include <cstddef>

#include "fusion/pose/maps/grid_map.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

struct ExtrudeOptions {
  double height = 2.5;           ///< m, of walls and of the ceiling's lower side
  double occupied_above = 0.65;  ///< minimum probability of an occupied cell (map_server's occupied_thresh)
  double free_below = 0.35;      ///< maximum probability of a free cell
  double min_wall_length = 0.3;  ///< m; shorter pieces are labelled unknown
  double slab_thickness = 0.1;   ///< m, of floor and ceiling
  /// Groups of fewer cells are dropped where they are out of reach; 1 drops nothing.
  int min_support = 4;
  /// Within reach: less than `reach` (m, along x and along y) from a possible position of a robot's centre,
  /// with known free cells for at least `clear_radius` (m) all around.
  double clear_radius = 0.15;
  double reach = 0.75;
  bool floor = true;  ///< a slab under all observed cells, top at z = 0
  bool ceiling = false;
};

/// The model, with the map's id. Deterministic; no two boxes of a label overlap by the model's own rule.
/// Errors: a map whose cells do not fit its size, or without an occupied cell; options out of range.
Result<SemanticModel> extrude(const pose::GridMap& map, const ExtrudeOptions& options);

/// Quality of a model against its grid map, computed independently of how it was made: each cell against each
/// wall, door, pillar and unknown box.
struct ExtrusionFigures {
  std::size_t occupied_cells = 0;
  std::size_t covered_cells = 0;  ///< occupied cells whose centre is inside a box
  double box_area = 0;            ///< m^2, of all boxes' footprints, overlaps counted twice
  double box_area_over_free = 0;  ///< m^2 of that area over free cells
  std::size_t walls = 0;
  std::size_t unknown = 0;
};
ExtrusionFigures measure_extrusion(const pose::GridMap& map, const SemanticModel& model,
                                   const ExtrudeOptions& options);

}  // namespace parhelion::semantic
