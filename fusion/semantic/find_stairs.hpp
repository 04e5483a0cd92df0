// Flights of stairs: level surfaces that climb in equal rises, each strip beside the one before. Internal to
// the semantic net.
#pragma once

#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/plan_blocks.hpp"
#include "fusion/semantic/segmentation.hpp"
#include "fusion/semantic/semantic_net.hpp"

namespace parhelion::semantic {

/// One level of a flight, in the flight's own plan axes.
struct Step {
  std::uint32_t horizontal =
      no_surface;              ///< surface of the segmentation; none: found between the others only
  double z = 0;                ///< m, of its tread
  double near = 0, far = 0;    ///< m along the flight's direction
  double left = 0, right = 0;  ///< m across it
};

struct Flight {
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  ///< unit, upwards
  std::vector<Step> steps;                               ///< from the lowest; the first is what it stands on
  double score = 0;                                      ///< logarithm, as stairs against chance

  std::vector<double> rises() const;
  std::vector<double> treads() const;  ///< m, from one riser to the next
};

std::vector<Flight> find_flights(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation,
                                 const SemanticNetOptions& options);

/// Adds levels at both ends for as long as the points beside them continue the series of rises.
void extend(const PlanBlocks& points, const Segmentation& segmentation, Flight& flight);

/// Heights of sparse treads without the risers beside them.
void refine_heights(const PlanBlocks& points, const Segmentation& segmentation, Flight& flight);

/// Weighs the measured heights against rises that are built alike, each by how well it is known: a tread that
/// leans in the cloud says its height badly. Well measured ones stay where they are, unequal rises included.
void even_rises(const PlanBlocks& points, Flight& flight);

}  // namespace parhelion::semantic
