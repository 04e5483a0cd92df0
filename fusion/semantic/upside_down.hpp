// Whether a levelled cloud is upside down, or lies on its side.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/level_patches.hpp"

namespace parhelion::semantic {

/// Whether the scanners stood at one height over what lies beyond them along -y, and at different ones along
/// -z: the y axis points upwards.
bool has_y_upwards(const cloud::PointCloud<Cloud>& cloud);

/// Whether the scanners stood: they saw what is over them, and nothing under their tripods but the ground
/// around. Upside down it is the other way round. Scanners that see both, or that look down from above, tell
/// nothing, nor do cameras: where one looks is no property of the building.
bool saw_overhead(const cloud::PointCloud<Cloud>& cloud, const Eigen::Vector3d& up);

/// Why the cloud seems to be upside down with `up` (unit, cloud frame) as its up direction; empty: it does
/// not. More hangs than stands in it, and no scanners saw what is overhead.
std::string why_upside_down(const cloud::PointCloud<Cloud>& cloud, const std::vector<PlanePatch>& patches,
                            const Eigen::Vector3d& up);

/// Weaker evidence, for a warning: why the cloud may be upside down or lie on its side; empty: nothing shows
/// that.
std::string doubt_of_up(const cloud::PointCloud<Cloud>& cloud, const std::vector<PlanePatch>& patches,
                        const Eigen::Vector3d& up);

}  // namespace parhelion::semantic
