// Where the map frame and the robot are in an RGB-D folder, which knows of neither.
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
  float depth_min = 0, depth_max = 0;  ///< m, seen

  Transform<Map, DepthOptical> map_optical(const Eigen::Isometry3d& T_world_depth) const {
    return Transform<Map, DepthOptical>(T_map_world * T_world_depth);
  }
  Transform<Map, Base> map_base(const Eigen::Isometry3d& T_world_depth) const {
    return map_optical(T_world_depth) * T_base_depth.inverse();
  }
};

/// From gravity or the level surfaces, the floor, and the mean pose of the camera. `notes` gets what was
/// assumed and found. Error: no pose, no up, no floor.
Result<RgbdPlacement> place_rgbd(const RgbdFolder& folder, std::vector<std::string>& notes);

}  // namespace parhelion::tools
