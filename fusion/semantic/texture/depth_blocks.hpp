// A coarse depth image: the range of depths around each block of pixels.
#pragma once

#include <algorithm>
#include <span>

#include "fusion/semantic/texture/views.hpp"

namespace parhelion::semantic {

class DepthBlocks {
 public:
  /// Depths (m, 0: none) row by row. Blocks are as large as makes about 160 columns, and no smaller than
  /// `min_step` pixels.
  DepthBlocks(const Pinhole& camera, std::span<const float> depth, int min_step = 1);

  struct Range {
    float nearest = 0, farthest = 0;  ///< m; 0: nothing was measured
    bool measured() const { return farthest > 0; }
  };
  /// Of the block that holds the pixel and the eight around it. The pixel must be contained.
  const Range& around(const Eigen::Vector2d& pixel) const {
    return around_[block_of(static_cast<int>(pixel.x() + 0.5), static_cast<int>(pixel.y() + 0.5))];
  }

  int step() const { return step_; }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  std::size_t blocks() const { return static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_); }
  std::size_t block_of(int column, int row) const { return at(column / step_, row / step_); }
  std::size_t at(int block_column, int block_row) const {
    return static_cast<std::size_t>(block_row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(block_column);
  }
  /// Calls `visit` with each of the eight blocks around one that are in the image.
  template <class Visit>
  void each_neighbour(std::size_t block, const Visit& visit) const {
    const int column = static_cast<int>(block % static_cast<std::size_t>(columns_));
    const int row = static_cast<int>(block / static_cast<std::size_t>(columns_));
    for (int y = std::max(0, row - 1); y <= std::min(rows_ - 1, row + 1); ++y)
      for (int x = std::max(0, column - 1); x <= std::min(columns_ - 1, column + 1); ++x)
        if (x != column || y != row) visit(at(x, y));
  }

 private:
  int step_, columns_, rows_;
  std::vector<Range> around_;
};

/// Marks the blocks that touch a marked one, too.
void widen(std::vector<std::uint8_t>& marked, const DepthBlocks& blocks);
/// Unmarks connected groups of fewer blocks.
void drop_small_groups(std::vector<std::uint8_t>& marked, const DepthBlocks& blocks, std::size_t min_blocks);
/// A byte for each pixel.
std::vector<std::uint8_t> pixels_of(const std::vector<std::uint8_t>& marked, const DepthBlocks& blocks,
                                    const Pinhole& camera);

}  // namespace parhelion::semantic
