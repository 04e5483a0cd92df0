// Draws the plan of a site for pages, which draw robots on it.
#pragma once

#include <optional>

#include "protocols/model.hpp"
#include "server/station/station.hpp"

namespace parhelion::tools {

/// Floors are light, objects on them dark, unknown space is transparent; 5 cm a pixel, or coarser so that the
/// longer side has at most 4096. nullopt: nothing to draw.
std::optional<station::StationMap> draw_site_map(const SemanticModel& model);

}  // namespace parhelion::tools
