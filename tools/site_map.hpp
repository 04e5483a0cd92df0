// The plan of a site as a picture for pages, on which robots are drawn.
#pragma once

#include <optional>

#include "protocols/model.hpp"
#include "server/station/station.hpp"

namespace parhelion::tools {

/// Floors light, what stands on them dark, nothing where nothing is known; 5 cm a pixel, or as many as make
/// 4096 of the longer side. nullopt: there is nothing to be drawn.
std::optional<station::StationMap> draw_site_map(const SemanticModel& model);

}  // namespace parhelion::tools
