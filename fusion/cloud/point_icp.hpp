// The paper's ICP at full resolution: exact closest points in a bucket grid (algorithm 1) and the closed form
// for the motion that brings the pairs together (equation 1).
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/cloud/bucket_grid.hpp"
#include "fusion/cloud/nearest_point.hpp"

namespace parhelion {

struct PointIcpOptions {
  double max_distance = 0.5;  ///< m, furthest partner
  bool paper_grid = false;    ///< 28 buckets along the longest side; else about 4 points in a bucket
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
  /// -1: none. Among equally near ones the first in the grid's order.
  std::vector<std::int32_t> partners() const;
  const PairMoments& moments() const { return moments_; }
  /// Of the last step: source points that had to search.
  std::size_t searched() const { return searched_; }

 private:
  struct Query {
    Eigen::Vector3f p;          ///< in the source's frame
    std::int32_t partner = -1;  ///< in the grid's order
    float clearance = -1;       ///< m, no other point is nearer than this; negative: not known
  };
  NearestPoint search(const Eigen::Vector3f& p, const NearestPoint& known, float reach) const;

  PointIcpOptions options_;
  BucketGrid grid_;
  std::vector<float> x_, y_, z_;  ///< the target in the grid's order, padded by 8 far points
  std::vector<Query> queries_;    ///< in the order of the source's own buckets
  std::vector<std::uint32_t> source_order_;
  Eigen::Isometry3d last_T_ = Eigen::Isometry3d::Identity();
  PairMoments moments_;
  std::size_t searched_ = 0;
};

}  // namespace parhelion
