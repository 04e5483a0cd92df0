// The nearest target surfel with a similar normal, for each surfel of the source.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "fusion/cloud/bucket_grid.hpp"
#include "fusion/cloud/surfels.hpp"

namespace parhelion::cloud {

/// The target's surfels, sorted by bucket; the bucket size is that of the surfels.
struct SurfelTarget {
  explicit SurfelTarget(const Surfels& target);
  Surfels surfels;
  BucketGrid grid;
};

/// Tracks the partner of each source surfel as T changes: while a surfel moves less than its margin to the
/// second nearest, its partner is still the nearest and no search is needed.
class PartnerSearch {
 public:
  /// A normal is too uncertain to be compared where Surfels::slack is not below this.
  static constexpr float kFlatEnough = 0.25f;

  /// Both must outlive this. `gate`: m, largest distance of a partner; at most 2.5 of the target's buckets.
  PartnerSearch(const SurfelTarget& target, const Surfels& source, double gate);

  /// Call update(i) once for each i afterwards, from any thread.
  void move_to(const Eigen::Isometry3d& T_target_source);
  void update(std::size_t i);

  /// The index in the target (the lowest among equally near ones); -1: none within the gate. It depends only
  /// on the last T.
  std::int32_t partner(std::size_t i) const { return tracked_[i].partner; }

 private:
  struct Tracked {
    std::int32_t partner = -1;
    float clearance = -1;  ///< m, no other surfel with a similar normal is nearer than this
    float turn = 0;        ///< rad, sum of rotations since the first T up to which `clearance` is valid
  };
  struct Query {
    Eigen::Vector3f p, n;
    bool normal_is_certain;  ///< flat enough: its normal is compared
    float nearest2;          ///< m^2, of the partner; the gate's where there is none
    float other2;            ///< m^2, of the nearest other one
    std::int32_t found = -1;
  };
  float facing(const Query& query, std::uint32_t j) const;
  void consider(Query& query, std::uint32_t j, float d2) const;
  float search(Query& query) const;

  const SurfelTarget* target_;
  const Surfels* source_;
  std::vector<Tracked> tracked_;
  Eigen::Matrix3f R_ = Eigen::Matrix3f::Identity(), R_last_ = R_;
  Eigen::Vector3f t_ = Eigen::Vector3f::Zero(), t_last_ = t_;
  Eigen::Vector3f origin_;
  float gate_;                 ///< m
  float inverse_bucket_size_;  ///< 1/m
  float margin_;               ///< m
  double turned_ = 0;          ///< rad, in sum since the first T
  bool both_oriented_;         ///< source and target; else normals are compared without their sign
};

}  // namespace parhelion::cloud
