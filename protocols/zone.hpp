// Zones of a scenario: areas whose entering and leaving are events.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion {

/// An upright prism in the map.
struct Zone {
  std::string name;                      ///< unique among the zones
  std::vector<Eigen::Vector2d> outline;  ///< m, map frame; does not intersect itself; either direction
  double bottom = -1e4, top = 1e4;       ///< m, z
};

/// Why a zone is invalid, or success: no name, fewer than three corners, no area, intersecting sides, a top
/// that is not above its bottom.
Status check_zone(const Zone& zone);

/// Whether p is inside, or outside by no more than `margin` (m, >= 0).
bool inside(const Zone& zone, const Eigen::Vector3d& p, double margin);

}  // namespace parhelion
