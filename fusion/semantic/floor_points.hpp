// Points of a floor that its level box misses: floors bow, and where scans overlap they lie in layers.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::semantic {

/// Labels as floor the unknown points that, within one scan, go on from its floor without a step: from plan
/// cell to plan cell by at most 6 cm in a metre and 1.5 cm, up to 15 cm over and 50 cm under the floor where
/// it began. An object that stands on the floor rises by a step, and so stays what it is. `labels`: one per
/// point. Each scan grows by itself (region growing as in Himmelsbach et al. 2010, with heights instead of
/// lines), for between scans that bow differently there are steps which are none.
void grow_floors(const cloud::PointCloud<Map>& cloud, std::vector<std::uint8_t>& labels);

}  // namespace parhelion::semantic
