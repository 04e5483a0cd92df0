// What is measured of a ramp that was found: its width, its error, its points. Internal to the semantic net.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {

inline constexpr double kOnRamp = 0.035;  ///< m, from a ramp's plane to its points

/// Floor and unknown points within 3 m of each ramp in plan, and some that are a little further. `labels`:
/// EntityLabel, one per point.
std::vector<std::vector<std::uint32_t>> points_around_ramps(const cloud::PointCloud<Map>& cloud,
                                                            std::span<const std::uint8_t> labels,
                                                            const std::vector<ModelEntity>& ramps);

/// Cells are coarse: moves the ramp's sides to the points on its upper half, where a floor beside it is
/// lower. Leaves them where these are few. `around`: the points around the ramp.
void fit_width(const cloud::PointCloud<Map>& cloud, std::span<const std::uint32_t> around, ModelEntity& ramp);

/// m, what the error of the scanners' angles may add to a ramp's height; 0: not known. That error bends
/// floors, by decimetres where scanners stand low; how much is seen on the level floor at the ramp's end.
/// `floor`: m, its height.
double height_error(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
                    std::span<const std::uint32_t> around, const ModelEntity& ramp, double floor);

/// Whether a point lies on its surface, or on the faces under its edges.
bool is_on_ramp(const ModelEntity& ramp, const Eigen::Vector3d& at);

}  // namespace parhelion::semantic
