// The convex hull of points in a plane.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace parhelion {

/// Convex hull, counter-clockwise (Andrew's monotone chain).
std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points);

}  // namespace parhelion
