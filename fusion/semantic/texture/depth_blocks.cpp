#include "fusion/semantic/texture/depth_blocks.hpp"

#include <algorithm>

namespace parhelion::semantic {
namespace {

constexpr int kColumns = 160;

void include(DepthBlocks::Range& range, const DepthBlocks::Range& more) {
  if (!more.measured()) return;
  range.nearest = range.measured() ? std::min(range.nearest, more.nearest) : more.nearest;
  range.farthest = std::max(range.farthest, more.farthest);
}

}  // namespace

DepthBlocks::DepthBlocks(const Pinhole& camera, std::span<const float> depth, int min_step)
    : step_(std::max({1, min_step, camera.width / kColumns})),
      columns_((camera.width + step_ - 1) / step_),
      rows_((camera.height + step_ - 1) / step_) {
  std::vector<Range> own(blocks());
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const float z = depth[camera.at(column, row)];
      if (z > 0) include(own[block_of(column, row)], {z, z});
    }
  around_ = own;
  for (std::size_t i = 0; i < own.size(); ++i)
    each_neighbour(i, [&](std::size_t beside) { include(around_[i], own[beside]); });
}

void widen(std::vector<std::uint8_t>& marked, const DepthBlocks& blocks) {
  const std::vector<std::uint8_t> before = marked;
  for (std::size_t i = 0; i < before.size(); ++i)
    if (before[i] != 0) blocks.each_neighbour(i, [&](std::size_t beside) { marked[beside] = 1; });
}

void drop_small_groups(std::vector<std::uint8_t>& marked, const DepthBlocks& blocks, std::size_t min_blocks) {
  std::vector<std::uint8_t> open = marked;
  std::vector<std::size_t> group;
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (open[i] == 0) continue;
    group.assign(1, i);
    open[i] = 0;
    for (std::size_t next = 0; next < group.size(); ++next)
      blocks.each_neighbour(group[next], [&](std::size_t beside) {
        if (open[beside] != 0) group.push_back(beside);
        open[beside] = 0;
      });
    if (group.size() >= min_blocks) continue;
    for (const std::size_t block : group) marked[block] = 0;
  }
}

std::vector<std::uint8_t> pixels_of(const std::vector<std::uint8_t>& marked, const DepthBlocks& blocks,
                                    const Pinhole& camera) {
  std::vector<std::uint8_t> pixels(camera.pixels());
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column)
      pixels[camera.at(column, row)] = marked[blocks.block_of(column, row)];
  return pixels;
}

}  // namespace parhelion::semantic
