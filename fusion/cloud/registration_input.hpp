// What registration asks of clouds and options before it begins.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fusion/cloud/registration.hpp"

namespace parhelion::cloud {

/// m, four of five points are within it of the middle point: the size of a scene, whatever few points do.
double scene_radius(const std::vector<Eigen::Vector3f>& points);

/// m, of the finest resolution.
double surfel_size_of(double target_radius, double source_radius);

Status check_cloud(const PointCloud<Target>& cloud);
Status check_cloud(const PointCloud<Source>& cloud);
Status check_options(const RegistrationOptions& options);

/// Clouds of the same place are of about one size; a factor of a thousand is a unit. Scene radii, m.
Status check_scales(double target, double source, double max_distance);

}  // namespace parhelion::cloud
