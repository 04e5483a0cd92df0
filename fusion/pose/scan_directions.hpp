// The directions of the surfaces that a scan saw.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace parhelion::pose {

/// For each point, in the order of the beams, the unit direction of the line that it and its neighbours on
/// both sides lie on; zero where these are not in line, too far away, or missing: at corners, edges and
/// vegetation.
void assign_directions(std::span<const Eigen::Vector2d> points, std::vector<Eigen::Vector2d>& directions);

}  // namespace parhelion::pose
