// A robot's outline as a person writes it, and what of a URDF's is missing.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tools/robot/urdf_outline.hpp"

namespace parhelion::tools {

/// From "length,width" about base_link, or at least three corners "x,y x,y x,y": m. Convex,
/// counter-clockwise. Throws WrongAnswer.
std::vector<Eigen::Vector2d> read_footprint(const std::string& text);

/// "base_link, left_track (meshes that were not read)".
std::string missing_parts(const UrdfOutline& urdf);

}  // namespace parhelion::tools
