// What lies before and behind an opening of a wall. Internal to the semantic net.
#pragma once

#include "fusion/semantic/net/wall_candidates.hpp"

namespace parhelion::semantic {

/// Fractions of its width, but for `niche`. "Beside" is the wall on that side of it where there is more.
struct OpeningSurroundings {
  double floor_behind = 0;                    ///< the floor continues through it
  double floor_before = 0, floor_beside = 0;  ///< floor lies just before the wall
  /// Any low point lies 8 to 25 cm before the wall: of a floor, a step, a table.
  double low_before = 0, low_beside = 0;
  /// Fraction of its cells between two heights with a surface 0.4 to 0.8 m behind the wall. Where viewpoints
  /// are known, only what was seen from before it counts.
  double niche = 0;
};

/// Surroundings of columns [c0, c1) of the wall's raster. `low`, `high`: m, the heights of `niche`.
OpeningSurroundings surroundings_of(const PlanPoints& points, const WallCandidate& wall, int c0, int c1,
                                    double low, double high);

/// Whether something stands before the opening and hides it: neither floor nor anything else that is low lies
/// before it, but both lie beside it. Below a scanner and on raised floors one of the two misleads.
bool is_behind_furniture(const OpeningSurroundings& around);

}  // namespace parhelion::semantic
