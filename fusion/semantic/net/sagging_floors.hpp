// Joins floors that a small error of the scanner's angles has separated: at long range it lowers a floor by
// decimetres.
#pragma once

#include <cstddef>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {

/// Joins to a larger level floor each smaller one beside it that is lower by no more than the error of the
/// scanners' angles, estimated from the farther half of the larger floor's own points (90th percentile). A
/// real step down is recognised by scans that are sharp. `cloud.labels`: EntityLabel per point; without
/// viewpoints nothing is joined. Returns the number of removed floors; their relations are transferred to the
/// larger one.
std::size_t join_sagging_floors(const cloud::PointCloud<Map>& cloud, SemanticModel& model);

}  // namespace parhelion::semantic
