// The part of the plane that beams have passed, as a grid of bits.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace parhelion::pose {

class SeenArea {
 public:
  SeenArea() = default;
  /// Covers the rectangle between two corners, m.
  SeenArea(const Eigen::Vector2d& low, const Eigen::Vector2d& high);

  /// What lies outside of the rectangle is not kept.
  void add_beam(const Eigen::Vector2d& from, const Eigen::Vector2d& to);
  /// Beams have passed p on all sides, some 0.25 to 0.5 m away: nothing stood there.
  bool is_inside(const Eigen::Vector2d& p) const;

 private:
  static constexpr double kCell = 0.25;  ///< m
  bool holds(int column, int row) const {
    return column >= 0 && row >= 0 && column < columns_ && row < rows_;
  }
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  int columns_ = 0, rows_ = 0;
  std::vector<bool> passed_;
};

}  // namespace parhelion::pose
