// Walls that were seen in mirrors: images of walls, behind the wall that the mirror hangs on. Internal to the
// semantic net.
#pragma once

#include <vector>

#include "fusion/semantic/net/wall_candidates.hpp"
#include "fusion/semantic/net/wall_raster.hpp"

namespace parhelion::semantic {

/// Lowers the score of each candidate that another one, A, mirrors: its reflection in A's plane lies on a
/// third wall, and the rays that measured it cross A above its foot. Rooms as deep on both sides of A are
/// told apart by A's thickness. Walls across A end at its plane where such rays alone measured the rest;
/// their indices are returned, as they are to be measured again. Without viewpoints nothing is known of rays,
/// and nothing changes. After Käshammer and Nüchter 2015, "Mirror identification and correction of 3D point
/// clouds".
std::vector<std::size_t> weigh_mirrored(const PlanPoints& points, std::vector<WallCandidate>& walls);

}  // namespace parhelion::semantic
