// What a URDF says of a real robot: where its links are, its outline, height and mass.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

struct UrdfOutline {
  std::string name;  ///< of the robot
  std::string root;  ///< first link
  /// m, z of the floor in the root's frame: that of base_footprint where there is one, or else of the lowest
  /// point of the shapes.
  double floor = 0;
  std::vector<std::string> links;  ///< parents before children
  std::map<std::string, Eigen::Isometry3d>
      T_base_link;                         ///< joints at zero; base: the root's frame on the floor
  std::vector<Eigen::Vector2d> footprint;  ///< m, base; convex, counter-clockwise; empty: no shapes
  double height = 0;                       ///< m, top over the floor
  double mass = 0;                         ///< kg
  std::vector<std::string> left_out;       ///< links with shapes that were not read: not in the outline
  /// Whether these carry the robot: no shape is left on the links that are fixed to the root, or they have
  /// most of the mass. The outline of the rest is not the robot's.
  bool lacks_base = false;
  std::vector<std::string> warnings;  ///< meshes that were not found, and angles that look like degrees
};

/// Collision shapes count, or visual ones where a link has no other; meshes are read. Errors as of
/// read_urdf(), and of a file that cannot be read.
Result<UrdfOutline> read_urdf_outline(const std::string& path);

/// Links whose name contains one of these words, whatever their case; those of the last words first.
std::vector<std::string> links_named(const UrdfOutline& urdf, const std::vector<std::string>& words);

}  // namespace parhelion::tools
