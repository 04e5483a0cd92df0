// Flights as slopes: treads and risers alternate around an inclined plane, also where no tread is wide or
// dense enough to be a surface. Internal to the semantic net.
#pragma once

#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/net/flight_profile.hpp"

namespace parhelion::semantic {

/// An inclined plane with points around it, as those of a flight are.
struct StairSlope {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  Eigen::Vector2d uphill = Eigen::Vector2d::UnitX();
  double rise = 0;             ///< m/m
  double left = 0, width = 0;  ///< m, across it
  std::size_t points = 0;
};

/// The site's slopes, each once, those with most points first.
std::vector<StairSlope> find_slopes(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation);

/// The longest run of even steps on a slope, of at least two rises; else no step.
Flight flight_on(const StepPoints& points, const StairSlope& slope);

}  // namespace parhelion::semantic
