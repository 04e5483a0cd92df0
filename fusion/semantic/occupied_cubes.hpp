// Which cubes of space hold points, a bit each: for counting them and their neighbours.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "fusion/cloud/voxel_index.hpp"

namespace parhelion::semantic {

class OccupiedCubes {
 public:
  /// `cube`: each coordinate within 2^20 of 0.
  void add(const Eigen::Array3i& cube);
  bool contains(const Eigen::Array3i& cube) const;
  std::size_t count() const;
  /// Pairs of an occupied cube and another one among the 26 around it; each pair counts from both sides.
  std::size_t count_neighbours() const;

 private:
  struct Block {
    Eigen::Array3i at;        ///< in blocks
    std::uint64_t cubes = 0;  ///< of 4 x 4 x 4, x fastest
  };
  cloud::VoxelIndex number_of_;
  std::vector<Block> blocks_;
  std::uint32_t last_ = 0;  ///< block of the last cube: cubes in sequence often share it
};

}  // namespace parhelion::semantic
