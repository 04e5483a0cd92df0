// The part of the plane that beams have passed, as a grid of bits.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

namespace parhelion::pose {

class SeenArea {
 public:
  SeenArea() = default;
  /// Covers a square around `centre`, which reaches `reach` (m) to each side.
  SeenArea(const Eigen::Vector2d& centre, double reach);

  /// A beam to the surface that it met. What lies outside of the square is not kept.
  void add_beam(const Eigen::Vector2d& from, const Eigen::Vector2d& to);
  /// Beams have passed p, and everywhere around it within some 0.25 m.
  bool is_inside(const Eigen::Vector2d& p) const;

 private:
  static constexpr double kCell = 0.25;  ///< m
  /// Of the cell at a place given in cells from the corner; nullopt: outside.
  std::optional<std::size_t> index(double x, double y) const;

  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  std::size_t side_ = 0;  ///< cells
  std::vector<bool> passed_;
};

}  // namespace parhelion::pose
