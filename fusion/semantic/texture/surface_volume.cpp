#include "fusion/semantic/texture/surface_volume.hpp"

#include <limits>

#include "fusion/semantic/texture/voxel_blocks.hpp"

namespace parhelion::semantic {
namespace {

constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();

/// The voxels at the corners of a block's cells: its own and the first ones of seven neighbours.
class Corners {
 public:
  Corners(const VoxelBlocks& grid, const BlockKey& key) {
    for (std::size_t i = 0; i < 8; ++i) {
      const auto bit = [&](std::size_t b) { return static_cast<int>(i >> b & 1U); };
      block_[i] = grid.find({key.x + bit(0), key.y + bit(1), key.z + bit(2)});
    }
  }
  Voxel at(int x, int y, int z) const {
    const auto over = [](int v) { return static_cast<std::size_t>(v / kBlock); };
    const VoxelBlock* block = block_[over(x) + 2 * over(y) + 4 * over(z)];
    return block == nullptr ? Voxel{} : block->voxels[VoxelBlock::at(x % kBlock, y % kBlock, z % kBlock)];
  }

 private:
  std::array<const VoxelBlock*, 8> block_{};
};

/// The corner i of the cell (x, y, z): bits of i are the offsets.
Voxel corner_of(const Corners& corners, int x, int y, int z, int i) {
  return corners.at(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
}

/// Mean of the points where the distance changes its sign along the cell's edges, in voxels from its corner;
/// false: none, or a corner was not seen.
bool crossing(const Corners& corners, int x, int y, int z, float min_weight, Eigen::Vector3f& mean) {
  std::array<float, 8> distance{};
  int inside = 0;
  for (int i = 0; i < 8; ++i) {
    const Voxel voxel = corner_of(corners, x, y, z, i);
    if (voxel.weight < min_weight) return false;
    distance[static_cast<std::size_t>(i)] = voxel.distance;
    inside += voxel.distance < 0;
  }
  if (inside == 0 || inside == 8) return false;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  int count = 0;
  for (int a = 0; a < 8; ++a) {
    for (int axis = 0; axis < 3; ++axis) {
      const int b = a | 1 << axis;
      const float from = distance[static_cast<std::size_t>(a)], to = distance[static_cast<std::size_t>(b)];
      if (b == a || (from < 0) == (to < 0)) continue;
      Eigen::Vector3f point(static_cast<float>(a & 1), static_cast<float>(a >> 1 & 1),
                            static_cast<float>(a >> 2));
      point[axis] = from / (from - to);
      sum += point;
      ++count;
    }
  }
  mean = sum / static_cast<float>(count);
  return true;
}

/// Index of the vertex of each cell of each block.
class Net {
 public:
  Net(const VoxelBlocks& grid, const VolumeOptions& options) : grid_(grid), options_(options) {
    vertex_.resize(grid.blocks().size());
    for (std::size_t i = 0; i < grid.blocks().size(); ++i) place(i);
    for (std::size_t i = 0; i < grid.blocks().size(); ++i) connect(i);
  }
  QuadSurface take() { return std::move(surface_); }

 private:
  using Cells = std::array<std::uint32_t, kBlock * kBlock * kBlock>;

  void place(std::size_t i) {
    const VoxelBlock& block = grid_.blocks()[i];
    const Corners corners(grid_, block.key);
    vertex_[i].fill(kNone);
    for (int z = 0; z < kBlock; ++z) {
      for (int y = 0; y < kBlock; ++y) {
        for (int x = 0; x < kBlock; ++x) {
          Eigen::Vector3f offset;
          if (!crossing(corners, x, y, z, options_.min_weight, offset)) continue;
          vertex_[i][VoxelBlock::at(x, y, z)] = static_cast<std::uint32_t>(surface_.vertices.size());
          const Eigen::Vector3f cell =
              Eigen::Vector3i(block.key.x * kBlock + x, block.key.y * kBlock + y, block.key.z * kBlock + z)
                  .cast<float>();
          surface_.vertices.push_back(static_cast<float>(options_.voxel) * (cell + offset));
        }
      }
    }
  }

  /// The vertex of a cell that may lie in the block before.
  std::uint32_t vertex(const BlockKey& key, int x, int y, int z) const {
    const BlockKey at{key.x - (x < 0), key.y - (y < 0), key.z - (z < 0)};
    const VoxelBlock* block = grid_.find(at);
    if (block == nullptr) return kNone;
    const auto index = static_cast<std::size_t>(block - grid_.blocks().data());
    const auto wrap = [](int v) { return v < 0 ? v + kBlock : v; };
    return vertex_[index][VoxelBlock::at(wrap(x), wrap(y), wrap(z))];
  }

  /// A quad around each edge of the grid along which the sign changes.
  void connect(std::size_t i) {
    const VoxelBlock& block = grid_.blocks()[i];
    const Corners corners(grid_, block.key);
    for (int z = 0; z < kBlock; ++z)
      for (int y = 0; y < kBlock; ++y)
        for (int x = 0; x < kBlock; ++x)
          for (int axis = 0; axis < 3; ++axis) connect_edge(block.key, corners, {x, y, z}, axis);
  }

  void connect_edge(const BlockKey& key, const Corners& corners, const Eigen::Vector3i& at, int axis) {
    Eigen::Vector3i to = at, u = Eigen::Vector3i::Zero(), v = Eigen::Vector3i::Zero();
    to[axis] += 1;
    u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1;
    const Voxel a = corners.at(at.x(), at.y(), at.z()), b = corners.at(to.x(), to.y(), to.z());
    if (a.weight < options_.min_weight || b.weight < options_.min_weight ||
        (a.distance < 0) == (b.distance < 0))
      return;
    const std::array<Eigen::Vector3i, 4> cells = {at - u - v, at - v, at, at - u};
    std::array<std::uint32_t, 4> quad{};
    for (std::size_t i = 0; i < 4; ++i) {
      quad[i] = vertex(key, cells[i].x(), cells[i].y(), cells[i].z());
      if (quad[i] == kNone) return;
    }
    if (b.distance < 0) std::swap(quad[1], quad[3]);
    surface_.quads.push_back(quad);
  }

  const VoxelBlocks& grid_;
  const VolumeOptions& options_;
  std::vector<Cells> vertex_;
  QuadSurface surface_;
};

}  // namespace

QuadSurface fuse_depth(std::span<const DepthView> views, const VolumeOptions& options) {
  const VoxelBlocks grid(views, options);
  return without_small_pieces(Net(grid, options).take(), options.min_piece);
}

}  // namespace parhelion::semantic
