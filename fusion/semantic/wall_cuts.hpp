// Where the pieces of a wall begin and end: at openings and at flights of stairs. Internal to the semantic
// net.
#pragma once

#include <cstddef>
#include <vector>

#include "fusion/semantic/net_entities.hpp"

namespace parhelion::semantic {

/// A stretch of a wall.
struct WallStretch {
  double from = 0, to = 0;  ///< m along it, from its start
};

/// The wall without the end that lies across a flight: a riser in the plane of the wall beside it looks like
/// more of that wall, and nobody could climb past. What lies across the flight altogether stays whole.
WallStretch without_risers(const WallCandidate& wall, const std::vector<const Flight*>& flights);

/// The openings within the stretch that are no wall: doors, windows, and gaps that a scanner looked through;
/// one that nobody saw through is wall that something hid.
std::vector<std::size_t> openings_that_cut(const NetCandidates& candidates, const Labelling& labelling,
                                           std::size_t wall, const WallStretch& stretch);

/// m, where it ends above. A round wall has one top, the highest that a quarter of its length reaches: sight
/// ends lower elsewhere.
double top_of(const NetCandidates& candidates, const Labelling& labelling, std::size_t wall);

}  // namespace parhelion::semantic
