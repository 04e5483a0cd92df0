// Floors and ceilings as levels of a site, and where they are. Internal to the semantic net.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fusion/semantic/segmentation.hpp"

namespace parhelion::semantic {

/// What a horizontal surface looks like by itself.
struct LevelEvidence {
  double lowest = 0;   ///< share of its plan cells below which nothing was measured
  double highest = 0;  ///< the same above
};

class Levels {
 public:
  Levels(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation);

  const std::vector<LevelEvidence>& evidence() const { return evidence_; }  ///< per horizontal surface
  double floor() const { return floor_; }  ///< m, of the main floor; the cloud's foot where there is none
  std::optional<double> ceiling() const { return ceiling_; }  ///< m, of the main ceiling
  double top() const { return top_; }                         ///< m, of what was measured (99.5 percent)

  /// The ceiling over a wall that reaches `z_high`, else the top of what was measured; and the floor under
  /// `z_low`.
  double over(const Eigen::Vector2d& p, double z_high) const;
  double under(const Eigen::Vector2d& p, double z_low) const;

  /// Score (logarithm) of each horizontal surface as floor, ceiling, and neither.
  double floor_score(std::size_t horizontal) const;
  double ceiling_score(std::size_t horizontal) const;

 private:
  const Segmentation& segmentation_;
  /// Parts of a larger level nearby: a bow of the same floor, a lamp or a beam under the same ceiling.
  void find_parts();

  std::vector<LevelEvidence> evidence_;
  std::vector<double> floor_part_, ceiling_part_;  ///< what that takes from the scores
  double floor_ = 0, top_ = 0;
  bool has_floor_ = false;
  std::optional<double> ceiling_;
};

}  // namespace parhelion::semantic
