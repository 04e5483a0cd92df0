// The directions of a building's walls. Most walls are parallel or at right angles, so by how much those that
// a scan sees are turned against those before is the drift of the heading (orthogonal SLAM, Nguyen and others
// 2006). Here any direction that recurs will do, and how far walls are from it is measured.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace parhelion::pose {

/// A straight piece of surface in one scan.
struct WallPiece {
  double direction = 0;  ///< rad, base_link
  double length = 0;     ///< m; of a long one as much as it counts for
};

/// The straight pieces of a scan, whose points are in the order of the beams.
std::vector<WallPiece> wall_pieces(std::span<const Eigen::Vector2d> points);

class WallDirections {
 public:
  /// `yaw`: of the robot that saw them in the map, rad.
  void add(std::span<const WallPiece> pieces, double yaw);
  /// By how much pieces are turned against those that were added, rad. nullopt: too few of them have a
  /// direction that recurs.
  std::optional<double> turned(std::span<const WallPiece> pieces, double yaw) const;
  /// rad^2, of one wall's direction about that which recurs: by the angles between walls that one scan sees.
  double variance() const;

 private:
  static constexpr std::size_t kBins = 180;  ///< over a right angle

  double sum_around(int bin) const;
  std::optional<double> recurring(double direction) const;

  std::array<double, kBins> length_{};  ///< m, of pieces
  double total_ = 0;
  double squared_angles_ = 0, compared_ = 0;  ///< rad^2 m, m: between pieces of one scan
};

}  // namespace parhelion::pose
