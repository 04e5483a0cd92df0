// Points of the scanner itself and of the robot or person that carried it: they were there for one scan only.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::semantic {

/// Labels as free space what is unknown within a metre of the viewpoint that saw it (not over 0.2 m higher),
/// was seen by no other scan, and has at least half of it looked through by other scans; what touches
/// something else, too. Within 0.3 m, where no scanner measures, a thing by itself goes without that.
/// `labels`: one per point. Without viewpoints nothing is done.
void drop_carriers(const cloud::PointCloud<Map>& cloud, std::vector<std::uint8_t>& labels);

}  // namespace parhelion::semantic
