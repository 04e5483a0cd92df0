// Floors only where they were seen: what nobody observed is not floor.
#pragma once

#include "fusion/semantic/evidence.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {

/// Each level floor is cut into pieces that cover where it was measured or where a line of sight passed just
/// over it and not on through it; the largest keeps its name (and so its relations), the others are
/// "floor 1.2" and are part of it. `observed` of a piece is the share of it that was. A floor of which
/// nothing was observed goes, with its relations.
void cut_floors(const EvidenceGrid& evidence, SemanticModel& model);

}  // namespace parhelion::semantic
