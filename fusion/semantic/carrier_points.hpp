// Points of the scanner itself and of the robot or person that carried it: they were there for one scan only.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"

namespace parhelion {

/// Labels as free space the unknown things within a metre of the viewpoint that saw them (not over 0.2 m
/// higher) which no other scan saw, and which lie within 0.3 m of it, where no scanner measures, or through
/// at least half of which other scans looked. What is joined to anything farther away stays. `labels`: one
/// per point. Without viewpoints nothing is done.
void drop_carriers(const PointCloud<Map>& cloud, std::vector<std::uint8_t>& labels);

}  // namespace parhelion
