// Floor points outside of the floor's level box: floors bow, and overlapping scans form layers.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::semantic {

/// Labels as floor the unknown points that continue a floor without a step within one scan: from plan cell to
/// plan cell by at most 6 cm in a metre and 1.5 cm, up to 15 cm over and 50 cm under the floor where it
/// began. An object on the floor rises by a step and keeps its label. So does what lies more than 3 cm over
/// the floor on two opposite sides within a metre (diagonally 1.4 m), or 4.5 cm over the floor on one side
/// within 40 cm. `labels`: one per point. Each scan is grown separately (region growing as in Himmelsbach et
/// al. 2010, with heights instead of lines), as scans that bow differently show false steps between them.
void grow_floors(const cloud::PointCloud<Map>& cloud, std::vector<std::uint8_t>& labels);

}  // namespace parhelion::semantic
