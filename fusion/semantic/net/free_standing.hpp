// Tells things that stand free in a room, such as rows of shelves and lockers, from walls. Internal to the
// semantic net.
#pragma once

#include <vector>

#include "fusion/semantic/net/wall_candidates.hpp"

namespace parhelion::semantic {

/// Lowers the scores of two parallel surfaces that are the faces of one thing: both end well below the
/// ceiling, and between them the ceiling was measured, but neither the floor nor anything else up there. So
/// it does with one that stands before a wall, and with one alone that is lower than 2.5 m and joins no wall
/// where floor and ceiling go on at both its sides.
void weigh_free_standing(const PlanPoints& points, std::vector<WallCandidate>& walls);

}  // namespace parhelion::semantic
