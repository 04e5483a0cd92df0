// Restricts floors to the observed area.
#pragma once

#include <vector>

#include "fusion/semantic/net/evidence.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {

/// The heights at which cut_floors asks a grid of such cubes (m).
std::vector<HeightRange> heights_of_floors(const SemanticModel& model, double cube);

/// Cuts each level floor into pieces that cover the area that was measured, or over which a line of sight
/// passed closely without going through it. The largest keeps its name (and so its relations); the others are
/// named "floor 1.2" and are part of it. `observed` of a piece is its observed fraction. An unobserved floor
/// is removed with its relations.
void cut_floors(const EvidenceGrid& evidence, SemanticModel& model);

}  // namespace parhelion::semantic
