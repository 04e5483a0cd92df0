// Finds flights of stairs: level surfaces that climb in equal rises, each strip adjacent to the previous one.
// Internal to the semantic net.
#pragma once

#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/net/semantic_net.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"

namespace parhelion::semantic {

/// One level of a flight, in the flight's own plan axes.
struct Step {
  std::uint32_t horizontal =
      kNoSurface;              ///< surface of the segmentation; none: only interpolated between the others
  double z = 0;                ///< m, of its tread
  double near = 0, far = 0;    ///< m along the flight's direction
  double left = 0, right = 0;  ///< m across it
};

struct Flight {
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  ///< unit, upwards
  std::vector<Step> steps;  ///< from the lowest; the first is the level below the flight
  double score = 0;         ///< log odds of stairs against chance

  std::vector<double> rises() const;
  std::vector<double> treads() const;  ///< m, from one riser to the next
};

struct StepPoints;  // flight_profile.hpp
class StripPoints;  // flight_strip.hpp

std::vector<Flight> find_flights(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation,
                                 const SemanticNetOptions& options);

/// Adds levels at both ends while the points there continue the series of rises.
void extend(const StepPoints& points, Flight& flight);

/// Recomputes the heights of sparse treads without the points of the adjacent risers.
void refine_heights(const StripPoints& points, const Segmentation& segmentation, Flight& flight);

/// Adjusts the measured heights towards equal rises, each weighted by its accuracy: a tread that is inclined
/// in the cloud has an uncertain height. Accurate ones keep their heights, including unequal rises.
void even_rises(const StripPoints& points, Flight& flight);

}  // namespace parhelion::semantic
