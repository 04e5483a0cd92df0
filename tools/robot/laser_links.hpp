// Where the lasers of a robot are: by links of its URDF, or by positions that a person gives.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "tools/robot/urdf_outline.hpp"

namespace parhelion::tools {

struct LaserPlace {
  std::string link;  ///< empty: a position
  Eigen::Isometry3d T_base_laser = Eigen::Isometry3d::Identity();
  std::string source() const { return link.empty() ? "[answer]" : "[urdf] " + link; }
};

/// From a link's name, or from "x,y,z" or "x,y,z,yaw" in base_link (m and degrees); nullopt: "-", none.
/// Throws WrongAnswer.
std::optional<LaserPlace> read_laser_place(const UrdfOutline& urdf, const std::string& text);

/// Links that may each be another laser, the likeliest first. Of links within 0.1 m of one another, such as
/// a mount and its frame, the first counts, and those at `taken` are left out.
std::vector<LaserPlace> likely_lasers(const UrdfOutline& urdf, const std::vector<LaserPlace>& taken);

/// A name for a laser after the first, which its channels get: of what its link's name has beside words such
/// as "laser" and "link". `number`: of the laser, from 2, for a link that has no other word.
std::string laser_name(const std::string& link, std::size_t number);

}  // namespace parhelion::tools
