// The paper's ICP at full resolution: exact closest points (algorithm 1) and the closed form for the motion
// that brings the pairs together (equation 1). The points are in the paper's bucket grid, or in a tree of
// boxes, which fits clouds that are denser in one place than in another.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "fusion/cloud/bucket_grid.hpp"
#include "fusion/cloud/nearest_point.hpp"
#include "fusion/cloud/point_tree.hpp"

namespace parhelion::cloud {

struct PointIcpOptions {
  double max_distance = 0.5;  ///< m, furthest partner
  bool paper_grid = false;    ///< 28 buckets along the longest side; else the tree
  bool portable = false;      ///< the twin without AVX2, which finds the same partners
  int threads = 0;            ///< 0: all; 1: the serial twin, which gives the same bits
};

/// The rotation and translation that minimise the sum of |b_i - (R a_i + t)|^2, from the moments of the pairs
/// (Umeyama 1991, equations 34 to 43, scale 1).
struct PairMoments {
  double n = 0;
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();  ///< sums
  Eigen::Matrix3d ba = Eigen::Matrix3d::Zero();                              ///< sum of b a^T
  double squares = 0;                                                        ///< m^2, sum of |b - a|^2

  PairMoments& operator+=(const PairMoments& other);
};
Eigen::Isometry3d closest_motion(const PairMoments& moments);

/// Keeps the target in buckets and for each source point its last partner: as long as the source moves less
/// than the second nearest is further, the partner is still the nearest, and no search is needed.
class PointIcp {
 public:
  /// Points are finite, of both at least one.
  PointIcp(std::span<const Eigen::Vector3f> target, std::span<const Eigen::Vector3f> source,
           const PointIcpOptions& options);

  /// Finds the partners at T, and the next T from them; the moments are those of the pairs before the step.
  Eigen::Isometry3d step(const Eigen::Isometry3d& T_target_source);

  /// For each source point the index of its nearest target point within max_distance at the last step's T;
  /// -1: none. Among equally near ones the first in the grid's or the tree's order.
  std::vector<std::int32_t> partners() const;
  const PairMoments& moments() const { return moments_; }
  /// Of the last step: source points that had to search.
  std::size_t searched() const { return searched_; }

 private:
  static constexpr std::size_t group_ = 16;  ///< source points that are looked up together
  using Sixteen = Eigen::Array<float, group_, 1>;
  /// Neighbours in the source; columns are filled up by copies of the last.
  struct Group {
    Sixteen x, y, z;                           ///< m, in the source's frame
    std::array<std::int32_t, group_> partner;  ///< in the target's order; -1: none within max_distance
    Sixteen clearance;                         ///< m, no other point is nearer than this; negative: not known
    std::size_t count;
  };
  /// Both transforms of a step, and what their difference does to a point.
  struct Motion {
    Eigen::Isometry3f T, change;
  };
  struct Sum;
  struct Room;
  Eigen::Vector3f target(std::int32_t i) const;
  NearestPoint search_grid(const Eigen::Vector3f& p, float reach) const;
  void step_group(Group& group, const Motion& motion, Room& room, Sum& sum) const;
  void search_tree(Group& group, Room& room) const;
  void add_pairs(const Group& group, const Room& room, Sum& sum) const;

  PointIcpOptions options_;
  std::optional<BucketGrid> grid_;
  std::optional<PointTree> tree_;
  std::vector<float> x_, y_, z_;  ///< the target in the grid's order, padded by 8 far points
  std::vector<Group> groups_;     ///< the source in the order of a tree of its own
  std::vector<std::uint32_t> source_order_;
  Eigen::Isometry3f last_T_ = Eigen::Isometry3f::Identity();
  float rounding_ = 0;  ///< m
  PairMoments moments_;
  std::size_t searched_ = 0;
};

}  // namespace parhelion::cloud
