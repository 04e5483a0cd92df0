#include "fusion/semantic/occupied_cubes.hpp"

#include <algorithm>
#include <array>
#include <bit>

namespace parhelion::semantic {
namespace {

constexpr int kOrigin = 1 << 20;  ///< indices must not be negative
constexpr int kSide = 4, kPadded = kSide + 2;

Eigen::Vector3i block_of(const Eigen::Array3i& from_origin) {
  return {from_origin.x() >> 2, from_origin.y() >> 2, from_origin.z() >> 2};
}

std::uint64_t bit_of(const Eigen::Array3i& from_origin) {
  const int within = (from_origin.x() & 3) + kSide * ((from_origin.y() & 3) + kSide * (from_origin.z() & 3));
  return std::uint64_t{1} << within;
}

/// Rows of cubes along x, by z and y; bit 0 of each is one cube before the block.
using Rows = std::array<std::array<std::uint8_t, kPadded>, kPadded>;

std::uint8_t row_of(std::uint64_t cubes, int y, int z) {
  return static_cast<std::uint8_t>(cubes >> (kSide * (y + kSide * z)) & 0xF);
}

/// Adds the part of a block within one cube of another, which lies `offset` blocks before it.
void add_rows(std::uint64_t cubes, const Eigen::Array3i& offset, Rows& rows) {
  for (int z = 0; z < kSide; ++z) {
    for (int y = 0; y < kSide; ++y) {
      const int to_z = z + 1 + kSide * offset.z(), to_y = y + 1 + kSide * offset.y();
      if (to_z < 0 || to_z >= kPadded || to_y < 0 || to_y >= kPadded) continue;
      const unsigned row = row_of(cubes, y, z);
      const unsigned moved = offset.x() == 0 ? row << 1 : offset.x() < 0 ? row >> 3 : (row & 1) << 5;
      rows[static_cast<std::size_t>(to_z)][static_cast<std::size_t>(to_y)] |=
          static_cast<std::uint8_t>(moved);
    }
  }
}

/// Pairs of a cube of a block's row and one of a padded row that differ by at most one along x.
using PairTable = std::array<std::array<std::uint8_t, 64>, 16>;

PairTable pair_table() {
  PairTable table;
  for (unsigned row = 0; row < 16; ++row) {
    for (unsigned padded = 0; padded < 64; ++padded)
      table[row][padded] = static_cast<std::uint8_t>(
          std::popcount(row & padded) + std::popcount(row & padded >> 1) + std::popcount(row & padded >> 2));
  }
  return table;
}

}  // namespace

void OccupiedCubes::add(const Eigen::Array3i& cube) {
  const Eigen::Array3i from_origin = cube + kOrigin;
  const Eigen::Vector3i at = block_of(from_origin);
  if (blocks_.empty() || (blocks_[last_].at != at.array()).any()) {
    std::uint32_t& number = number_of_[at];
    if (number == cloud::VoxelIndex::kNone) {
      number = static_cast<std::uint32_t>(blocks_.size());
      blocks_.push_back({at, 0});
    }
    last_ = number;
  }
  blocks_[last_].cubes |= bit_of(from_origin);
}

bool OccupiedCubes::contains(const Eigen::Array3i& cube) const {
  const Eigen::Array3i from_origin = cube + kOrigin;
  const std::uint32_t number = number_of_.at(block_of(from_origin));
  return number != cloud::VoxelIndex::kNone && (blocks_[number].cubes & bit_of(from_origin)) != 0;
}

std::size_t OccupiedCubes::count() const {
  std::size_t sum = 0;
  for (const Block& block : blocks_) sum += static_cast<std::size_t>(std::popcount(block.cubes));
  return sum;
}

std::size_t OccupiedCubes::count_neighbours() const {
  static const PairTable pairs = pair_table();
  std::size_t sum = 0;
  for (const Block& block : blocks_) {
    Rows rows{};
    number_of_.for_each_about(
        block.at, [&](std::uint32_t n) { add_rows(blocks_[n].cubes, blocks_[n].at - block.at, rows); });
    for (int z = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y) {
        const auto& of_row = pairs[row_of(block.cubes, y, z)];
        for (int k = 0; k < 9; ++k)
          sum += of_row[rows[static_cast<std::size_t>(z + k / 3)][static_cast<std::size_t>(y + k % 3)]];
      }
    }
  }
  return sum - count();  // each is one of the cubes around itself
}

}  // namespace parhelion::semantic
