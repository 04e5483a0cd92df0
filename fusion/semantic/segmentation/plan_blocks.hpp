// Points sorted into square blocks of the plan; empty blocks take no memory, so memory is proportional to the
// number of points, not the extent. Internal to this module.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace parhelion::semantic {

/// Immutable after construction; may be read by any number of threads.
class PlanBlocks {
 public:
  struct Block {
    int x = 0, y = 0;                  ///< in block sides from the origin
    std::uint32_t begin = 0, end = 0;  ///< into `sorted` and `order`
  };

  /// Blocks with sides of `side` metres (> 0), aligned with the origin. Points beyond `reach` are ignored.
  PlanBlocks(std::span<const Eigen::Vector3f> points, double side);

  static constexpr double kReach = 1e7;  ///< m in x and y; a float's step there is 1 m

  double side() const { return side_; }
  const std::vector<Block>& blocks() const { return blocks_; }  ///< by y, then x
  const std::vector<Eigen::Vector3f>& sorted() const { return sorted_; }
  const std::vector<std::uint32_t>& order() const { return order_; }  ///< index in the input points

  int coordinate(double metres) const { return static_cast<int>(std::floor(metres / side_)); }

  /// Calls visit(block, index in `blocks`) for those in the rectangle of block coordinates, inclusive.
  template <class Visit>
  void for_each_in(int x0, int y0, int x1, int y1, Visit&& visit) const {
    const auto row_begin = [&](int y) {
      return std::lower_bound(blocks_.begin(), blocks_.end(), std::pair{y, x0},
                              [](const Block& b, const std::pair<int, int>& key) {
                                return std::pair{b.y, b.x} < key;
                              });
    };
    for (auto it = row_begin(y0); it != blocks_.end() && it->y <= y1;) {
      const int y = it->y;
      for (; it != blocks_.end() && it->y == y && it->x <= x1; ++it) {
        if (it->x >= x0) visit(*it, static_cast<std::size_t>(it - blocks_.begin()));
      }
      if (it != blocks_.end()) it = row_begin(it->y == y ? y + 1 : it->y);
    }
  }

 private:
  double side_;
  std::vector<Block> blocks_;
  std::vector<Eigen::Vector3f> sorted_;
  std::vector<std::uint32_t> order_;
};

}  // namespace parhelion::semantic
