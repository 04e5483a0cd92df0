// Refines a segment proposed by the Hough transform: total least squares on the pixels near it, extended as
// far as they reach. Internal to this module.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "fusion/semantic/segmentation/plan_blocks.hpp"

namespace parhelion::semantic {

/// The points p + t d of the plan with t in [low, high].
struct PlanLine {
  Eigen::Vector2d p = Eigen::Vector2d::Zero();
  Eigen::Vector2d d = Eigen::Vector2d::UnitX();  ///< unit
  double low = 0, high = 0;                      ///< m
  double weight = 0;                             ///< of the evidence on it, less at the band's edges
  double across(const Eigen::Vector2d& q) const { return d.x() * (q.y() - p.y()) - d.y() * (q.x() - p.x()); }
  double along(const Eigen::Vector2d& q) const { return d.dot(q - p); }
};

class LineRefiner {
 public:
  /// Evidence: x, y (m) and weight of each pixel that some vertical surface may occupy.
  LineRefiner(std::span<const Eigen::Vector3f> evidence, double pixel, double near, double min_length);

  /// Nothing where the remaining evidence does not form a segment. Thread-safe as long as claim() is not
  /// called.
  std::optional<PlanLine> refine(PlanLine line) const;

  /// Extends it over evidence at its ends that other lines have claimed: walls that meet share their corner.
  void extend_to_corners(PlanLine& line) const;

  /// Reserves the line's evidence for it.
  void claim(const PlanLine& line);

  const PlanBlocks& evidence() const { return evidence_; }

 private:
  struct Hit {
    double along, across, weight;
    std::uint32_t index;
  };
  void gather(const PlanLine& line, double low, double high, double band, bool claimed_too,
              std::vector<Hit>& hits) const;
  bool fit(PlanLine& line, const std::vector<Hit>& hits) const;
  bool grow(PlanLine& line, std::vector<Hit>& hits) const;
  bool stands_out(const PlanLine& line) const;
  bool covered(const PlanLine& line, const std::vector<Hit>& hits) const;

  double pixel_, near_, min_length_;
  PlanBlocks evidence_;
  std::vector<std::uint8_t> claimed_;  // per sorted evidence
};

}  // namespace parhelion::semantic
