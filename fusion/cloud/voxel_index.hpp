// Maps a cube of space to its number: a hash table of blocks of 4 x 4 x 4 cubes, so that neighbours are close
// in memory.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace parhelion::cloud {

class VoxelIndex {
 public:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  static constexpr int kBits = 21;  ///< indices are in [0, 2^21)

  VoxelIndex();

  /// Reference to the number of a cube; `kNone` where it is new, to be set by the caller. Valid until the
  /// next call.
  std::uint32_t& operator[](const Eigen::Vector3i& index);

  /// The number of a cube; `kNone` where it has none.
  std::uint32_t at(const Eigen::Vector3i& index) const {
    const Block* block = find({index.x() >> 2, index.y() >> 2, index.z() >> 2});
    return block == nullptr ? kNone : (*block)[within(index)];
  }

  /// Calls visit(number) for the up to 27 numbered cubes around and at `index`, by blocks, each in the order
  /// of z, y, x.
  template <class Visit>
  void for_each_about(const Eigen::Vector3i& index, Visit&& visit) const {
    const Eigen::Vector3i low = (index.array() - 1).max(0), high = index.array() + 1;
    const Eigen::Vector3i first(low.x() >> 2, low.y() >> 2, low.z() >> 2);
    const Eigen::Vector3i last(high.x() >> 2, high.y() >> 2, high.z() >> 2);
    for (int bz = first.z(); bz <= last.z(); ++bz) {
      for (int by = first.y(); by <= last.y(); ++by) {
        for (int bx = first.x(); bx <= last.x(); ++bx) {
          const Block* block = find({bx, by, bz});
          if (block == nullptr) continue;
          const int x1 = std::min(high.x() - 4 * bx, 3), y1 = std::min(high.y() - 4 * by, 3),
                    z1 = std::min(high.z() - 4 * bz, 3);
          for (int z = std::max(low.z() - 4 * bz, 0); z <= z1; ++z) {
            for (int y = std::max(low.y() - 4 * by, 0); y <= y1; ++y) {
              for (int x = std::max(low.x() - 4 * bx, 0); x <= x1; ++x) {
                const std::uint32_t number = (*block)[static_cast<std::size_t>(x + 4 * y + 16 * z)];
                if (number != kNone) visit(number);
              }
            }
          }
        }
      }
    }
  }

 private:
  using Block = std::array<std::uint32_t, 64>;
  static std::size_t within(const Eigen::Vector3i& index) {
    return static_cast<std::size_t>((index.x() & 3) + 4 * (index.y() & 3) + 16 * (index.z() & 3));
  }
  static std::uint64_t key(const Eigen::Vector3i& block);
  std::size_t place(std::uint64_t key) const;  ///< slot in keys_ of the key, or where it would be inserted
  const Block* find(const Eigen::Vector3i& block) const;
  void grow();

  std::vector<std::uint64_t> keys_;  ///< open addressing
  std::vector<std::uint32_t> block_of_key_;
  int shift_ = 0;
  std::vector<Block> blocks_;
  std::uint64_t last_key_;
  std::uint32_t last_block_ = 0;
};

}  // namespace parhelion::cloud
