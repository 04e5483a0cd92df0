// Checks of clouds and options before registration.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fusion/cloud/registration.hpp"

namespace parhelion::cloud {

/// m, radius about the median point that contains 80 % of the points: the scene's size, robust to outliers.
double scene_radius(const std::vector<Eigen::Vector3f>& points);

/// m, of the finest resolution.
double surfel_size_of(double target_radius, double source_radius);

Status check_cloud(const PointCloud<Target>& cloud);
Status check_cloud(const PointCloud<Source>& cloud);
Status check_options(const RegistrationOptions& options);

/// Clouds of the same place have similar sizes; a factor of a thousand indicates a wrong unit. Scene radii,
/// m.
Status check_scales(double target, double source, double max_distance);

}  // namespace parhelion::cloud
