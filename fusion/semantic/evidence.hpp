// What is known of space, in cubes as in the paper's figure 5: where a surface was measured, where a scanner
// looked through, and what nobody has seen. Only what was measured or looked through takes memory.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <unordered_map>

#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::semantic {

enum class Evidence : std::uint8_t { unobserved, seen_through, measured };

struct EvidenceOptions {
  double cube = 0.10;  ///< m, > 0
  double range = 30;   ///< m, of a line of sight; of a longer one only its end counts
  /// Of 16 x 16 x 16 cubes, 12 kB each; further ones stay unobserved. 0: as many as the cloud itself takes
  /// memory and 5,000 more.
  std::size_t most_blocks = 0;
};

/// Immutable after it was made.
class EvidenceGrid {
 public:
  /// Lines of sight go from the viewpoints (none: nothing is known to be looked through) to one point of each
  /// cube and view.
  explicit EvidenceGrid(const cloud::PointCloud<Map>& cloud, const EvidenceOptions& options = {});

  double cube() const { return options_.cube; }
  /// Of the cube that `p` (m, map) lies in.
  Evidence at(const Eigen::Vector3d& p) const;
  /// Cubes of that kind.
  std::size_t count(Evidence kind) const;
  /// Centres of the cubes that were measured and of those that were looked through, labels 0 and 1; by place.
  cloud::PointCloud<Map> centres() const;
  std::size_t blocks() const { return blocks_.size(); }

 private:
  static constexpr int kSide = 16;  ///< cubes of a block
  using Index = Eigen::Array3i;     ///< of a cube
  struct Block {
    Index first;  ///< its lowest cube
    std::array<Evidence, kSide * kSide * kSide> cubes{};
    std::array<std::uint16_t, kSide * kSide * kSide>
        followed{};  ///< 1 + the last view that was followed here
  };
  Index index_of(const Eigen::Vector3d& p) const { return (p / options_.cube).array().floor().cast<int>(); }
  static std::uint64_t key_of(const Index& cube);
  static std::size_t place_in(const Index& cube);
  /// nullptr: not there, and not to be made or no more room.
  Block* block_at(const Index& cube, bool make);
  void follow(const Eigen::Vector3d& eye, const Eigen::Vector3d& end);

  EvidenceOptions options_;
  std::deque<Block> blocks_;  // a pointer to one stays right
  std::unordered_map<std::uint64_t, std::uint32_t> block_of_;
  std::uint64_t last_key_ = ~std::uint64_t{0};
  Block* last_ = nullptr;
};

}  // namespace parhelion::semantic
