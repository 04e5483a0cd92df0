#include "fusion/pose/matching/match_consistency.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace parhelion::pose {
namespace {

constexpr int kIterations = 3;  ///< from the pose of the whole: a half's own pose is near
/// Directions in which the formal covariance is believed before the first scan.
constexpr double kFormalWeight = 9;
constexpr double kLever = 5;  ///< m: rotations are compared as distances there
/// m, formal 1 sigma of a whole scan, above which a direction is not determined by surfaces. Chosen on the
/// generated corridor (0.05 to 0.3 m along it), hall, ring and offices (0.02 m at most).
constexpr double kDetermined = 0.03;
/// A scan counts for at most so many times the present factor: where a half finds another place, the factor
/// rises within several scans, not by one.
constexpr double kMaxRise = 12;

constexpr double squared(double x) { return x * x; }

using Axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;

/// Rotation in m at the lever; the small addition keeps it finite where nothing is known.
Eigen::Matrix3d covariance_in_metres(const Eigen::Matrix3d& information) {
  const Eigen::DiagonalMatrix<double, 3> scale(1, 1, kLever);
  return scale * (information + 1e-3 * Eigen::Matrix3d::Identity()).inverse() * scale;
}

}  // namespace

MatchConsistency::MatchConsistency(std::size_t max_points) {
  for (auto& half : halves_) half.reserve(max_points);
  forget();
}

void MatchConsistency::forget() { squares_ = directions_ = kFormalWeight; }

void MatchConsistency::add(const SurfelMap& map, std::span<const Eigen::Vector2d> points_base,
                           const Pose2& T_map_base, const MatchOptions& options) {
  const std::size_t count = points_base.size();
  if (count < kMinPoints) return;
  for (auto& half : halves_) half.clear();
  for (std::size_t i = 0; i < count; ++i) halves_[i * kBlocks / count % 2].push_back(points_base[i]);
  MatchOptions near = options;
  near.iterations = kIterations;
  const Eigen::Matrix3d no_prior = Eigen::Matrix3d::Zero();
  const Match a = match(map, halves_[0], T_map_base, T_map_base, no_prior, near);
  const Match b = match(map, halves_[1], T_map_base, T_map_base, no_prior, near);
  const Eigen::Vector3d apart(a.T_map_base.x - b.T_map_base.x, a.T_map_base.y - b.T_map_base.y,
                              kLever * wrap_angle(a.T_map_base.yaw - b.T_map_base.yaw));
  const Eigen::Matrix3d covariance =
      covariance_in_metres(a.information) + covariance_in_metres(b.information);
  if (!apart.allFinite() || !covariance.allFinite()) return;
  Axes axes;
  axes.computeDirect(covariance);
  double squares = 0, directions = 0;
  for (int i = 0; i < 3; ++i) {
    const double variance = axes.eigenvalues()[i];
    // The covariance of the difference is four times that of the whole.
    if (!(variance > 0 && variance < 4 * squared(kDetermined))) continue;
    const double along = axes.eigenvectors().col(i).dot(apart);
    squares += along * along / variance;
    ++directions;
  }
  constexpr double kept = 1 - 1 / kMemory;
  squares_ = kept * squares_ + std::min(squares, kMaxRise * factor() * directions);
  directions_ = kept * directions_ + directions;
}

Eigen::Matrix3d MatchConsistency::information(const Eigen::Matrix3d& formal) const {
  const Eigen::DiagonalMatrix<double, 3> scale(1, 1, kLever), inverse_scale(1, 1, 1 / kLever);
  Axes axes;
  axes.computeDirect(inverse_scale * formal * inverse_scale);
  Eigen::Vector3d values = axes.eigenvalues();
  for (double& value : values) {
    value = std::max(0.0, value);
    // 1 where surfaces determine the direction, 0 where they do not.
    const double information = value * squared(kDetermined);
    const double determined = squared(information) / (1 + squared(information));
    value /= factor() < 1 ? std::pow(factor(), determined) : factor();
  }
  return scale * axes.eigenvectors() * values.asDiagonal() * axes.eigenvectors().transpose() * scale;
}

}  // namespace parhelion::pose
