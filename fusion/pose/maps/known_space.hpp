// Which parts of a map's plane were seen when it was made: elsewhere, what a laser finds does not contradict
// it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace parhelion::pose {

class KnownSpace {
 public:
  KnownSpace() = default;
  /// Nothing is known between these corners, m, map frame.
  KnownSpace(const Eigen::Vector2d& low, const Eigen::Vector2d& high);

  /// A beam from the laser to its end: everything between is known.
  void add_beam(const Eigen::Vector2d& from, const Eigen::Vector2d& to);
  void add(const Eigen::Vector2d& p_map);
  /// With its neighbourhood of 0.2 m: the far side of a known surface is not known. False outside the
  /// corners.
  bool contains(const Eigen::Vector2d& p_map) const;

 private:
  static constexpr double kCell = 0.2;  ///< m
  std::ptrdiff_t index(const Eigen::Vector2d& p_map) const;

  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  std::ptrdiff_t width_ = 0, height_ = 0;
  std::vector<bool> known_;
};

}  // namespace parhelion::pose
