// How far the covariance of a match is to be trusted: two halves of a scan, matched separately, must agree
// within it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "fusion/pose/matching/scan_match.hpp"

namespace parhelion::pose {

/// The formal covariance of a match (the inverse of Match::information) takes the noise of the points, and
/// how far neighbours share it, as the same in every building and of every laser. Here both are measured:
/// blocks of neighbouring points are dealt in turn to two halves, and each half is matched alone, from the
/// pose of the whole. With the formal covariances C_a and C_b, the squared difference d^T (C_a + C_b)^-1 d of
/// the two poses is on average the number of directions, times the factor by which formal covariances are
/// wrong. (A jackknife with one half of the blocks left out: Kuensch 1989, "The jackknife and the bootstrap
/// for general stationary observations".) It is averaged over about the last `kMemory` scans.
///
/// What both halves share stays unseen: a map that is bent, a sweep that was corrected with a wrong twist.
/// Whoever uses the factor adds a floor for these.
///
/// Never allocates after construction, for scans of up to `max_points`. Deterministic.
class MatchConsistency {
 public:
  static constexpr double kMemory = 100;         ///< scans
  static constexpr std::size_t kBlocks = 10;     ///< per scan
  static constexpr std::size_t kMinPoints = 60;  ///< fewer are not compared

  explicit MatchConsistency(std::size_t max_points);

  /// A scan that was matched to `map` with `options`, and lies at T_map_base. `points_base`: the points that
  /// were matched, m, in the order of the beams.
  void add(const SurfelMap& map, std::span<const Eigen::Vector2d> points_base, const Pose2& T_map_base,
           const MatchOptions& options);
  /// Before a scan of another laser, or in another map.
  void forget();

  /// True covariance to formal covariance; 1 before the first scan.
  double factor() const { return squares_ / directions_; }
  /// Match::information (x, y, yaw) as it should have been. Along directions that the points determine to
  /// some 0.03 m or worse, as along a corridor, it is hardly more than the formal one: what is known there
  /// comes from roughness of the map, whose errors are not those of the halves.
  Eigen::Matrix3d information(const Eigen::Matrix3d& formal) const;

 private:
  std::array<std::vector<Eigen::Vector2d>, 2> halves_;  ///< scratch
  double squares_, directions_;                         ///< exponentially decayed sums
};

}  // namespace parhelion::pose
