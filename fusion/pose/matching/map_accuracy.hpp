// Uncertainty of a perfectly matched pose that remains because the map itself is uncertain.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "fusion/pose/matching/surfel_map.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// The scans of a map were placed with errors, so that its surfaces are thicker than the laser's noise alone
/// makes them. The noise is measured between neighbouring returns of live scans, whose errors of pose and map
/// are the same (von Neumann 1941, "Distribution of the ratio of the mean square successive difference to the
/// variance"); medians keep people, corners and moved furniture out. What is left of a surface's thickness is
/// how far the scans of the map are apart; each surface is a mean of many of them, so that a match is off by
/// a part of that.
///
/// Never allocates after construction, for scans of up to `max_points`. Deterministic.
class MapAccuracy {
 public:
  explicit MapAccuracy(std::size_t max_points);

  /// A scan that lies at T_map_base. `points_base`: m, in the order of the beams.
  void add(const SurfelMap& map, std::span<const Eigen::Vector2d> points_base, const Pose2& T_map_base);

  /// 1 sigma of a pose matched to the map, m along one axis and rad.
  double position_sigma() const;
  double yaw_sigma() const;

 private:
  std::vector<double> distances_, thicknesses_;  ///< scratch: m, along the normal, of neighbours; m^2
  double excess_;                                ///< m^2, of thickness over noise
  int scans_;                                    ///< that it is a mean of
};

}  // namespace parhelion::pose
