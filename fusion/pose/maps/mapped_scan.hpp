// Scans at their poses in the map: the content of a .simplemap and the input of a grid map. Implemented in
// mrpt/simplemap.cpp.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "fusion/pose/maps/grid_map.hpp"
#include "protocols/pose2.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"

namespace parhelion::pose {

struct MappedScan {
  Pose2 T_map_base;
  Transform<Base, Laser> T_base_laser;
  Scan scan;              ///< as if taken at one instant; NaN: unknown
  double range_max = 80;  ///< m
};

/// Write and read MRPT's .simplemap. All 2D range scans of a file from elsewhere are read.
Status write_simplemap(std::span<const MappedScan> scans, const std::string& path);
Result<std::vector<MappedScan>> read_simplemap(const std::string& path);

/// MRPT's occupancy grid after inserting every scan; a cell that a scan hits is not freed by that scan.
GridMap grid_of(std::span<const MappedScan> scans, double resolution);

/// The points of a mapped scan, base_link.
std::vector<Eigen::Vector2d> points_of(const MappedScan& scan);

}  // namespace parhelion::pose
