// Scans at their places in the map: what a .simplemap holds, and what a grid map is made of.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "fusion/pose/slam.hpp"
#include "protocols/pose2.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"

namespace parhelion::pose {

struct MappedScan {
  Pose2 T_map_base;
  Transform<Base, Laser> T_base_laser;
  Scan scan;              ///< as if taken at once; NaN where nothing is known
  double range_max = 80;  ///< m
};

/// MRPT's .simplemap, both ways. Of a foreign one every 2D range scan is taken.
Status write_simplemap(std::span<const MappedScan> scans, const std::string& path);
Result<std::vector<MappedScan>> read_simplemap(const std::string& path);

/// MRPT's occupancy grid with every scan inserted.
GridMap grid_of(std::span<const MappedScan> scans, double resolution);

/// The points of a mapped scan, base_link.
std::vector<Eigen::Vector2d> points_of(const MappedScan& scan);

}  // namespace parhelion::pose
