// Occupancy of space in cubes as in the paper's figure 5: a surface was measured, a scanner looked through,
// or unobserved. Only measured or looked-through cubes take memory.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <unordered_map>
#include <vector>

#include "fusion/cloud/floor_index.hpp"
#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::semantic {

enum class Evidence : std::uint8_t { unobserved, seen_through, measured };

/// m, map frame.
struct HeightRange {
  double low = 0, high = 0;
};

struct EvidenceOptions {
  double cube = 0.10;  ///< m, > 0
  double range = 30;   ///< m, of a line of sight; for a longer one only its end counts
  /// Maximum number of blocks of 16 x 16 x 16 cubes, 12 kB each; further ones stay unobserved. 0: as many as
  /// take the memory of the cloud itself, plus 5,000.
  std::size_t max_blocks = 0;
  /// The only heights that at() will be asked for: what lies elsewhere may be missing, which saves most lines
  /// of sight. Empty: all heights.
  std::vector<HeightRange> asked;
};

/// Immutable after construction.
class EvidenceGrid {
 public:
  /// Lines of sight go from the viewpoints to one point of each cube and view; without viewpoints no cube
  /// counts as looked through.
  explicit EvidenceGrid(const cloud::PointCloud<Map>& cloud, const EvidenceOptions& options = {});

  double cube() const { return options_.cube; }
  /// Evidence of the cube that contains `p` (m, map).
  Evidence at(const Eigen::Vector3d& p) const;
  /// Number of cubes of that kind.
  std::size_t count(Evidence kind) const;
  /// Centres of the measured cubes (label 0) and of those looked through (label 1), sorted by position.
  cloud::PointCloud<Map> centres() const;
  std::size_t blocks() const { return blocks_.size(); }

 private:
  static constexpr int kSide = 16;  ///< cubes along a side of a block
  using Index = Eigen::Array3i;     ///< of a cube
  struct Block {
    Index first;  ///< its cube with the lowest indices
    std::array<Evidence, kSide * kSide * kSide> cubes{};
    std::array<std::uint16_t, kSide * kSide * kSide> followed{};  ///< 1 + the last view that was traced here
  };
  Index index_of(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d at = p / options_.cube;
    return {cloud::floor_index(at.x()), cloud::floor_index(at.y()), cloud::floor_index(at.z())};
  }
  static std::uint64_t key_of(const Index& cube);
  static std::size_t place_in(const Index& cube);
  /// nullptr: it does not exist, and `make` is false or the limit is reached.
  Block* block_at(const Index& cube, bool make);
  template <class BlockAt, class Mark>
  void follow(const Eigen::Vector3d& eye, const Eigen::Vector3d& end, BlockAt&& block_of_cube,
              Mark&& mark) const;
  struct Ray {
    std::uint32_t point = 0, view = 0;
  };
  /// All of them at once. `low`, `high`: cubes at the corners of the space that they pass; max_blocks allows
  /// every block of it.
  void follow_all(const cloud::PointCloud<Map>& cloud, const std::vector<Ray>& rays, const Index& low,
                  const Index& high);

  EvidenceOptions options_;
  std::deque<Block> blocks_;  // a deque keeps pointers valid
  std::unordered_map<std::uint64_t, std::uint32_t> block_of_;
  std::uint64_t last_key_ = ~std::uint64_t{0};
  Block* last_ = nullptr;
};

}  // namespace parhelion::semantic
