// Whether a levelled cloud is upside down.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/level_patches.hpp"

namespace parhelion::semantic {

/// Why the cloud seems to be upside down with `up` (unit, cloud frame) as its up direction; empty: it does
/// not. More hangs than stands in it, and no scanners saw what is overhead.
std::string why_upside_down(const cloud::PointCloud<Cloud>& cloud, const std::vector<PlanePatch>& patches,
                            const Eigen::Vector3d& up);

}  // namespace parhelion::semantic
