// Floors and ceilings as levels of a site, and their extent. Internal to the semantic net.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fusion/semantic/segmentation/segmentation.hpp"

namespace parhelion::semantic {

/// Evidence of one horizontal surface, without its neighbours.
struct LevelEvidence {
  double lowest = 0;      ///< fraction of its points with nothing measured below, to 1.5 m
  double highest = 0;     ///< the same above, but for a floor that lies on it
  double drops = 0;       ///< fraction of its observed rim beyond which the next surface is lower, to 1.4 m
  double walled = 0;      ///< fraction of its whole rim at which walls stand on it
  double overlooked = 0;  ///< of a narrow one the fraction of its points over which something was measured,
                          ///< to 10 m, but for a floor that lies on it
};

class Levels {
 public:
  Levels(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation);

  const std::vector<LevelEvidence>& evidence() const { return evidence_; }  ///< per horizontal surface
  double floor() const { return floor_; }  ///< m, of the main floor, else the cloud's lower end
  /// m, of the main floor, then of others that are wide, too, and at other heights.
  std::vector<double> floors() const;
  std::optional<double> ceiling() const { return ceiling_; }  ///< m, of the main ceiling
  double top() const { return top_; }  ///< m, upper end of the measurements (99.5th percentile)

  /// The ceiling over a wall that reaches `z_high`, else the top of the measurements; and the floor under
  /// `z_low`.
  double over(const Eigen::Vector2d& p, double z_high) const;
  double under(const Eigen::Vector2d& p, double z_low) const;

  /// Log score of each horizontal surface as floor, ceiling, and neither.
  double floor_score(std::size_t horizontal) const;
  double ceiling_score(std::size_t horizontal) const;

 private:
  const Segmentation& segmentation_;
  using SurfaceCells = std::vector<std::vector<std::uint32_t>>;  ///< per horizontal surface, ascending
  void find_evidence(const cloud::PointCloud<Map>& cloud);
  bool carries_floor(const SurfaceCells& cells, std::size_t h, std::uint32_t cell) const;
  /// Finds parts of a larger level nearby: a bow of the same floor, a lamp or a beam under the same ceiling.
  void find_parts();
  void find_raised();
  void find_tops();
  void find_scattered();

  std::vector<LevelEvidence> evidence_;
  std::vector<double> floor_part_, ceiling_part_;  ///< deductions from the scores for such parts
  double floor_ = 0, lowest_ = 0, top_ = 0;  ///< m: the widest floor, the lowest one, the highest points
  bool has_floor_ = false;
  std::optional<double> ceiling_;
};

}  // namespace parhelion::semantic
