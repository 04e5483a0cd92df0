// A sparse grid of signed distances: blocks of 8 x 8 x 8 voxels near measured surfaces.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "fusion/semantic/texture/surface_volume.hpp"

namespace parhelion::semantic {

inline constexpr int kBlock = 8;  ///< voxels along a block's edge

struct BlockKey {
  int x = 0, y = 0, z = 0;
  auto operator<=>(const BlockKey&) const = default;
};

struct Voxel {
  float distance = 0;  ///< m, positive on the free side
  float weight = 0;    ///< 0: never seen
};

struct VoxelBlock {
  BlockKey key;
  std::array<Voxel, kBlock * kBlock * kBlock> voxels{};
  static std::size_t at(int x, int y, int z) {
    return static_cast<std::size_t>((z * kBlock + y) * kBlock + x);
  }
};

/// All blocks, ordered by key. A voxel (i, j, k) lies at voxel * (i, j, k).
class VoxelBlocks {
 public:
  VoxelBlocks(std::span<const DepthView> views, const VolumeOptions& options);

  const std::vector<VoxelBlock>& blocks() const { return blocks_; }
  const VoxelBlock* find(const BlockKey& key) const;

 private:
  void allocate(const DepthView& view, const VolumeOptions& options);
  static void integrate_all(VoxelBlock& block, std::span<const DepthView> views,
                            std::span<const DepthView> guesses, const VolumeOptions& options);
  static void integrate(VoxelBlock& block, const DepthView& view, float factor, const VolumeOptions& options);

  std::map<BlockKey, std::size_t> index_;
  std::vector<VoxelBlock> blocks_;
};

}  // namespace parhelion::semantic
