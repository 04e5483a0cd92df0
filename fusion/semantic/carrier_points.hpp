// Points of the scanner itself and of the robot or person that carried it, which are present in one scan
// only.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::semantic {

/// Labels as free space the unknown points within a metre of the viewpoint that saw them (at most 0.2 m
/// higher) that no other scan saw and of which other scans look through at least half. Clusters that touch
/// something else are included. Isolated clusters within 0.3 m, below a scanner's minimum range, need no such
/// evidence. `labels`: one per point. Does nothing without viewpoints.
void drop_carriers(const cloud::PointCloud<Map>& cloud, std::vector<std::uint8_t>& labels);

}  // namespace parhelion::semantic
