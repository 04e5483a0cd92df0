// The floor that a depth camera sees, and what it tells of the camera's mounting.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "render/camera_model.hpp"
#include "render/depth_image.hpp"

namespace parhelion::tools {

/// m along the optical axis; 0: not measured.
double depth_at(const render::DepthPixels& image, int u, int v);

/// The mounting whose floor is level at z = 0 in base_link, with x, y and yaw of `T_base_optical`. Least
/// squares of the points within 0.2 m of z = 0 and 4 m of the camera, with a gate that narrows to 3 cm.
/// nullopt: no floor that reaches over half a metre both ways. The images have the size of the lens.
std::optional<Eigen::Isometry3d> level_by_floor(const std::vector<render::DepthPixels>& images,
                                                const render::Lens& lens,
                                                const Eigen::Isometry3d& T_base_optical);

}  // namespace parhelion::tools
