#include "fusion/semantic/texture/voxel_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/texture/depth_holes.hpp"

namespace parhelion::semantic {
namespace {

constexpr int kPixelStep = 4;  ///< of the pixels that say where blocks are needed

int floor_int(double x) { return static_cast<int>(std::floor(x)); }

/// m, 0: none that is used.
double depth_of(const DepthView& view, std::size_t pixel, double farthest) {
  const double depth = view.millimetres[pixel] * 1e-3;
  return depth > farthest ? 0 : depth;
}

}  // namespace

VoxelBlocks::VoxelBlocks(std::span<const DepthView> views, const VolumeOptions& options) {
  for (const DepthView& view : views) allocate(view, options);
  std::vector<DepthView> guesses(options.guess_weight > 0 ? views.size() : 0);
  cloud::for_each_chunk(guesses.size(), 1, options.threads, [&](std::size_t i, std::size_t, std::size_t) {
    guesses[i] = filled_holes(views[i], options.farthest);
  });
  for (const DepthView& view : guesses) allocate(view, options);
  blocks_.resize(index_.size());
  std::size_t next = 0;
  for (auto& [key, position] : index_) {
    blocks_[next].key = key;
    position = next++;
  }
  cloud::for_each_chunk(blocks_.size(), 64, options.threads,
                        [&](std::size_t, std::size_t begin, std::size_t end) {
                          for (std::size_t i = begin; i < end; ++i)
                            integrate_all(blocks_[i], views, guesses, options);
                        });
}

const VoxelBlock* VoxelBlocks::find(const BlockKey& key) const {
  const auto found = index_.find(key);
  return found == index_.end() ? nullptr : &blocks_[found->second];
}

void VoxelBlocks::allocate(const DepthView& view, const VolumeOptions& options) {
  const double side = kBlock * options.voxel;
  BlockKey last{std::numeric_limits<int>::max(), 0, 0};
  for (int row = 0; row < view.camera.height; row += kPixelStep) {
    for (int column = 0; column < view.camera.width; column += kPixelStep) {
      const double depth = depth_of(view, view.camera.at(column, row), options.farthest);
      if (depth <= 0) continue;
      const Eigen::Vector3d ray((column - view.camera.cx) / view.camera.fx,
                                (row - view.camera.cy) / view.camera.fy, 1);
      for (double along = -options.truncation; along <= options.truncation; along += 0.5 * side) {
        const Eigen::Vector3d p = view.T_map_optical * Eigen::Vector3d((depth + along) * ray);
        const BlockKey key{floor_int(p.x() / side), floor_int(p.y() / side), floor_int(p.z() / side)};
        if (key != last) index_.emplace(key, 0);
        last = key;
      }
    }
  }
}

void VoxelBlocks::integrate_all(VoxelBlock& block, std::span<const DepthView> views,
                                std::span<const DepthView> guesses, const VolumeOptions& options) {
  for (const DepthView& view : views) integrate(block, view, 1, options);
  for (const DepthView& view : guesses) integrate(block, view, options.guess_weight, options);
}

void VoxelBlocks::integrate(VoxelBlock& block, const DepthView& view, float factor,
                            const VolumeOptions& options) {
  const Eigen::Isometry3d T_optical_map = view.T_map_optical.inverse().isometry();
  const double side = kBlock * options.voxel;
  const Eigen::Vector3d corner = side * Eigen::Vector3d(block.key.x, block.key.y, block.key.z);
  const Eigen::Vector3d middle = T_optical_map * (corner + Eigen::Vector3d::Constant(side / 2));
  const double radius = side * 0.87;
  if (middle.z() + radius < 0.1 || middle.z() - radius > options.farthest + options.truncation) return;
  if (middle.z() > radius) {
    const double reach = radius / middle.z() * std::max(view.camera.fx, view.camera.fy) * 1.5;
    if (!view.camera.contains(view.camera.project(middle), -reach)) return;
  }
  for (int z = 0; z < kBlock; ++z) {
    for (int y = 0; y < kBlock; ++y) {
      for (int x = 0; x < kBlock; ++x) {
        const Eigen::Vector3d p = T_optical_map * (corner + options.voxel * Eigen::Vector3d(x, y, z));
        if (p.z() < 0.1) continue;
        const Eigen::Vector2d pixel = view.camera.project(p);
        if (!view.camera.contains(pixel)) continue;
        const double depth = depth_of(
            view, view.camera.at(static_cast<int>(pixel.x() + 0.5), static_cast<int>(pixel.y() + 0.5)),
            options.farthest);
        const double distance = depth - p.z();
        if (depth <= 0 || distance < -options.truncation) continue;
        // The noise of triangulated depth grows with the square of the distance.
        const auto weight = factor * static_cast<float>(1 / std::max(1.0, depth * depth));
        Voxel& voxel = block.voxels[VoxelBlock::at(x, y, z)];
        const auto clamped = static_cast<float>(std::min(distance, options.truncation));
        voxel.distance = (voxel.distance * voxel.weight + clamped * weight) / (voxel.weight + weight);
        voxel.weight += weight;
      }
    }
  }
}

}  // namespace parhelion::semantic
