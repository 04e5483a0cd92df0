// Which of many rectangles of the plan reach near a point. Internal to the semantic net.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace parhelion::semantic {

class PlanAreas {
 public:
  /// The next number, from 0 on, for the rectangle around `centre` (m) that reaches `half` (m) to both sides
  /// along `along` (length 1) and across it.
  void add(const Eigen::Vector2d& centre, const Eigen::Vector2d& along, const Eigen::Vector2d& half);
  /// The rectangles that reach into the point's cell of 0.5 m, ascending: all that contain it, and some that
  /// are near.
  std::span<const std::uint32_t> near(const Eigen::Vector2d& p) const;

 private:
  static constexpr double kCell = 0.5;  ///< m
  static std::uint64_t key(const Eigen::Vector2d& cell);

  std::uint32_t size_ = 0;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace parhelion::semantic
