// Cuts a wall into pieces at openings and at flights of stairs. Internal to the semantic net.
#pragma once

#include <cstddef>
#include <vector>

#include "fusion/semantic/net/net_entities.hpp"

namespace parhelion::semantic {

/// A stretch of a wall.
struct WallStretch {
  double from = 0, to = 0;  ///< m along it, from its start
};

/// The wall without the end that crosses a flight: a riser in the plane of the adjacent wall looks like part
/// of that wall and would block the stairs. A wall that lies entirely across the flight is kept whole.
WallStretch without_risers(const WallCandidate& wall, const std::vector<const Flight*>& flights);

/// The openings within the stretch that interrupt the wall: doors, windows, and gaps that a scanner looked
/// through. A gap without such a line of sight counts as hidden wall.
std::vector<std::size_t> openings_that_cut(const NetCandidates& candidates, const Labelling& labelling,
                                           std::size_t wall, const WallStretch& stretch);

/// m, upper end. A round wall has a single top, the highest that a quarter of its length reaches; the view of
/// the rest is limited.
double top_of(const NetCandidates& candidates, const Labelling& labelling, std::size_t wall);

}  // namespace parhelion::semantic
