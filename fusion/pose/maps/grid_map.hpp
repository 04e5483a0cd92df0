// An occupancy grid, and the files of ROS that hold one.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::pose {

/// Occupancy grid. Row 0 is at the lowest y.
struct GridMap {
  std::string id;                     ///< SHA-256 of the cells, hex: the map id of models and poses
  double resolution = 0.05;           ///< m
  double x_min = 0, y_min = 0;        ///< m, map frame, corner of cell (0, 0)
  int width = 0, height = 0;          ///< cells
  std::vector<float> occupied;        ///< probability 0..1, 0.5 unknown
  std::vector<Eigen::Vector3d> path;  ///< x, y, yaw driven while mapping, for pictures; may be empty
};

/// SHA-256, hex, over the geometry and the cells in map_server's trinary format (occupied, free, unknown):
/// the same before saving and after loading.
std::string grid_map_id(const GridMap& map);

/// Write and read ROS map YAML + PGM (map_server's trinary format). `prefix`.yaml and `prefix`.pgm are
/// overwritten. Errors name file and line or byte.
Status save_ros_map(const GridMap& map, const std::string& prefix);
Result<GridMap> load_ros_map(const std::string& yaml_path);

}  // namespace parhelion::pose
