// The paper's ICP (algorithm 1, equation 1) as one of the methods of registration.
#pragma once

#include <Eigen/Geometry>

#include "fusion/cloud/registration.hpp"
#include "fusion/cloud/surfel_descent.hpp"

namespace parhelion::cloud {

/// Point-to-point over all points of both clouds in the paper's grid of 28 x 28 x 28 cubes, until
/// convergence. The search radius starts at max_distance and is halved down to the gate of `verdict`, which
/// reduces the influence of surfaces that only one scan has seen. `verdict`: the level whose surfels are used
/// to check the result; its partners are those at T.
Descent descend_points(const PointCloud<Target>& target, const PointCloud<Source>& source,
                       const Level& verdict, const Eigen::Isometry3d& guess,
                       const RegistrationOptions& options);

}  // namespace parhelion::cloud
