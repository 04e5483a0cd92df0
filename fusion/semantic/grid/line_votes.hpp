// Votes of the greedy Hough transform over a grid. Internal to find_walls.cpp.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "fusion/semantic/grid/cell_grid.hpp"

namespace parhelion::semantic {

struct GridLine {
  Eigen::Vector2d point;  ///< cells
  double yaw = 0;
  Eigen::Vector2d along() const { return {std::cos(yaw), std::sin(yaw)}; }
  Eigen::Vector2d across() const { return {-std::sin(yaw), std::cos(yaw)}; }
  Eigen::Vector2d at(double t, double d) const { return point + t * along() + d * across(); }
};

/// Votes of cells for lines x cos a + y sin a = r, a in whole degrees, r in whole cells.
class LineVotes {
 public:
  explicit LineVotes(const CellGrid& grid)
      : rows_(2 * static_cast<int>(std::ceil(std::hypot(grid.width, grid.height))) + 3),
        votes_(static_cast<std::size_t>(kAngles) * static_cast<std::size_t>(rows_)),
        dead_(votes_.size()),
        bounds_((votes_.size() + kBlock - 1) / kBlock, std::numeric_limits<int>::max()) {
    for (int a = 0; a < kAngles; ++a) {
      const double radians = a * std::numbers::pi / kAngles;
      normal_.at(static_cast<std::size_t>(a)) = {std::cos(radians), std::sin(radians)};
    }
  }

  void add(const Eigen::Vector2d& p, int votes) {
    for (int a = 0; a < kAngles; ++a) {
      const double r = normal_[static_cast<std::size_t>(a)].dot(p);
      votes_[bin(a, static_cast<int>(std::lround(r)) + rows_ / 2)] += votes;
    }
  }

  /// The line with the most votes that is not excluded, if it has at least `min_votes`. Votes only decrease
  /// as walls are removed, so the last count of a block of bins is an upper bound of its current count.
  std::optional<GridLine> peak(int min_votes) {
    std::size_t best = votes_.size();
    int max_votes = min_votes - 1;
    for (std::size_t b = 0; b < bounds_.size(); ++b) {
      if (bounds_[b] <= max_votes) continue;
      bounds_[b] = 0;
      for (std::size_t i = b * kBlock; i < std::min((b + 1) * kBlock, votes_.size()); ++i) {
        if (dead_[i] != 0) continue;
        bounds_[b] = std::max(bounds_[b], votes_[i]);
        if (votes_[i] > max_votes) {
          max_votes = votes_[i];
          best = i;
        }
      }
    }
    if (best == votes_.size()) return std::nullopt;
    last_ = best;
    const auto a = best / static_cast<std::size_t>(rows_);
    const int middle = rows_ / 2;
    const double r = static_cast<double>(best % static_cast<std::size_t>(rows_)) - middle;
    return GridLine{r * normal_.at(a),
                    static_cast<double>(a) * std::numbers::pi / kAngles + std::numbers::pi / 2};
  }

  /// Excludes the last peak for good: it held no wall, and cells are only removed.
  void bury_peak() { dead_[last_] = 1; }

 private:
  static constexpr int kAngles = 180;
  std::size_t bin(int a, int row) const {
    return static_cast<std::size_t>(a) * static_cast<std::size_t>(rows_) + static_cast<std::size_t>(row);
  }
  static constexpr std::size_t kBlock = 64;
  int rows_;
  std::vector<int> votes_;
  std::vector<std::uint8_t> dead_;
  std::vector<int> bounds_;  ///< per block of bins, an upper bound of its largest count
  std::array<Eigen::Vector2d, kAngles> normal_;
  std::size_t last_ = 0;
};

}  // namespace parhelion::semantic
