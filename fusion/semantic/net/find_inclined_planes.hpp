// Inclined planes of a cloud that are seen from below. Internal to the semantic net.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/net/inclined_plane.hpp"

namespace parhelion::semantic {

/// Planes through points that are unknown or ceiling, as add_inclined_ceilings() says, with what was measured
/// on them. `labels`: EntityLabel, per point.
std::vector<InclinedPlane> find_inclined_planes(const cloud::PointCloud<Map>& cloud,
                                                std::span<const std::uint8_t> labels);

}  // namespace parhelion::semantic
