// The paper's ICP at full resolution: exact closest points (algorithm 1) and the closed form of the motion
// that aligns the pairs (equation 1). The points are in the paper's bucket grid, or in a tree of boxes, which
// suits clouds of uneven density.
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
  double max_distance = 0.5;  ///< m, largest distance of a partner
  bool paper_grid = false;    ///< 28 buckets along the longest side; else the tree
  bool portable = false;      ///< reference without AVX2, which finds the same partners
  int threads = 0;            ///< 0: all; 1: the serial reference, which gives the same bits
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

/// Keeps the target in buckets and the last partner of each source point: while a source point moves less
/// than its margin to the second nearest, its partner is still the nearest and no search is needed.
class PointIcp {
 public:
  /// Points are finite, at least one in each cloud.
  PointIcp(std::span<const Eigen::Vector3f> target, std::span<const Eigen::Vector3f> source,
           const PointIcpOptions& options);

  /// Finds the partners at T and computes the next T from them; the moments are those of the pairs before the
  /// step.
  Eigen::Isometry3d step(const Eigen::Isometry3d& T_target_source);

  /// For each source point the index of its nearest target point within max_distance at the last step's T;
  /// -1: none. Among equally near ones the first in the grid's or the tree's order.
  std::vector<std::int32_t> partners() const;
  const PairMoments& moments() const { return moments_; }
  /// Number of source points that needed a search in the last step.
  std::size_t searched() const { return searched_; }

 private:
  static constexpr std::size_t kGroup = 16;  ///< source points that are looked up together
  using Sixteen = Eigen::Array<float, kGroup, 1>;
  /// Neighbours in the source; the last group is padded with copies of its last point.
  struct Group {
    Sixteen x, y, z;                           ///< m, in the source's frame
    std::array<std::int32_t, kGroup> partner;  ///< in the target's order; -1: none within max_distance
    Sixteen clearance;                         ///< m, no other point is nearer than this; negative: unknown
    std::size_t count;
  };
  /// Both transforms of a step, and the effect of their difference on a point.
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
  std::vector<Group> groups_;     ///< the source in the order of its own tree
  std::vector<std::uint32_t> source_order_;
  Eigen::Isometry3f last_T_ = Eigen::Isometry3f::Identity();
  float rounding_ = 0;  ///< m
  PairMoments moments_;
  std::size_t searched_ = 0;
};

}  // namespace parhelion::cloud
