// Defines the map frame and the robot for an RGB-D folder, which contains neither.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/status.hpp"
#include "tools/import/rgbd_folder.hpp"

namespace parhelion::tools {

/// The map frame and the robot that carries the camera.
struct RgbdPlacement {
  Eigen::Isometry3d T_map_world = Eigen::Isometry3d::Identity();
  Transform<Base, DepthOptical> T_base_depth;
  Eigen::Isometry3d T_depth_colour = Eigen::Isometry3d::Identity();
  double camera_height = 0;
  float depth_min = 0, depth_max = 0;  ///< m, observed

  Transform<Map, DepthOptical> map_optical(const Eigen::Isometry3d& T_world_depth) const {
    return Transform<Map, DepthOptical>(T_map_world * T_world_depth);
  }
  Transform<Map, Base> map_base(const Eigen::Isometry3d& T_world_depth) const {
    return map_optical(T_world_depth) * T_base_depth.inverse();
  }
};

/// From gravity or level surfaces, the floor, and the mean pose of the camera. Assumptions and results are
/// added to `notes`. Error: no pose, no up direction, no floor.
Result<RgbdPlacement> place_rgbd(const RgbdFolder& folder, std::vector<std::string>& notes);

}  // namespace parhelion::tools
