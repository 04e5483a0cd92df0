// Space that a scanner saw through is empty: surfaces that an alignment puts there contradict it.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "fusion/cloud/surfels.hpp"

namespace parhelion::cloud {

/// Ranges seen from one viewpoint, per direction: six faces of a cube, cut into cells.
class RangeImage {
 public:
  /// Surfels and viewpoint in one frame.
  RangeImage(const Surfels& surfels, const Eigen::Vector3d& viewpoint);

  enum class Sight { unseen, in_front, on_surface, behind };
  /// Position of p along its ray, with a tolerance of `margin` metres. In front: nearer than every range seen
  /// in its direction and the directions around it.
  Sight sight(const Eigen::Vector3f& p, float margin) const;

 private:
  static constexpr int kSide = 64;  ///< cells along a face: 1.4 degrees
  struct Cell {
    float nearest = 0, furthest = 0;  ///< m; 0: nothing seen
  };
  struct Direction {
    int face = 0, u = 0, v = 0;
  };
  static Direction direction(const Eigen::Vector3f& ray);
  const Cell& cell(int face, int u, int v) const {
    return cells_[static_cast<std::size_t>((face * kSide + v) * kSide + u)];
  }

  Eigen::Vector3f viewpoint_;
  std::vector<Cell> cells_;
};

/// Counts of surfels.
struct FreeSpace {
  double in_front = 0, on_surface = 0;
  FreeSpace& operator+=(const FreeSpace& other);
};

/// Compares the flat surfels of `other` with the ranges seen from `viewpoints` in `seen`.
FreeSpace free_space(const Surfels& seen, std::span<const Eigen::Vector3d> viewpoints, const Surfels& other,
                     const Eigen::Isometry3d& T_seen_other, double margin);

}  // namespace parhelion::cloud
