// Returns that lie on no surface: dust, rain, mixed pixels between two surfaces, reflections.
#pragma once

#include <vector>

#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::semantic {

/// Per point: whether it is one of at most a few that lie together, farther from all others than points of a
/// surface would be there. Rays lie as far apart at a stray as on a surface at its place: that is the range
/// times the angle between a view's rays, and without viewpoints the usual spacing around. Poles, legs and
/// wires stay, because their points are in rows, and so do flat sparse surfaces. Empty where less than 0.3 %
/// would be left out (of large clouds a sample is judged), and where more than a fifth would be: then the
/// cloud is too sparse to tell.
std::vector<bool> stray_points(const cloud::PointCloud<Cloud>& cloud);

}  // namespace parhelion::semantic
