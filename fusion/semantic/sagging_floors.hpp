// Floors that are one: far from a scanner a small error of its angles sinks a floor by decimetres.
#pragma once

#include <cstddef>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {

/// Joins to a larger level floor each smaller one beside it that lies lower by no more than the scanners'
/// angles are off: as much as the farther half of the larger one's own points says (nine tenths of them). A
/// real step down is told from that by scans that are sharp. `cloud.labels`: EntityLabel per point; without
/// viewpoints nothing is joined. Returns how many floors went; relations with them go to the larger one.
std::size_t join_sagging_floors(const cloud::PointCloud<Map>& cloud, SemanticModel& model);

}  // namespace parhelion::semantic
