// The nearest surfel of the target that faces the same way, for surfels of the source.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "fusion/cloud/bucket_grid.hpp"
#include "fusion/cloud/surfels.hpp"

namespace parhelion::cloud {

/// The target's surfels, in the order of the buckets, which are of the surfels' own size.
struct SurfelTarget {
  explicit SurfelTarget(const Surfels& target);
  Surfels surfels;
  BucketGrid grid;
};

/// For each surfel of the source its partner, as T changes: as long as a surfel moves less than others are
/// further away, its partner is still the nearest, and no search is needed.
class PartnerSearch {
 public:
  static constexpr float flat_enough = 0.25f;  ///< slack above which a normal says too little to compare it

  /// Both must outlive this. `gate`: m, furthest partner; at most 2.5 of the target's buckets.
  PartnerSearch(const SurfelTarget& target, const Surfels& source, double gate);

  /// To be followed by update(i) for each i once, from any thread.
  void move_to(const Eigen::Isometry3d& T_target_source);
  void update(std::size_t i);

  /// The index in the target, of equally near ones the lowest; -1: none within the gate. It depends on the
  /// last T alone.
  std::int32_t partner(std::size_t i) const { return tracked_[i].partner; }

 private:
  struct Tracked {
    std::int32_t partner = -1;
    float clearance = -1;  ///< m, no other surfel is nearer than this that could face the same way
    float turn = 0;        ///< rad, how far all was turned since the first T, up to which that is true
  };
  struct Query {
    Eigen::Vector3f p, n;
    bool faces;
    float nearest2;  ///< m^2, of the partner; the gate's where there is none
    float other2;    ///< m^2, of the nearest other one
    std::int32_t found = -1;
  };
  float facing(const Query& query, std::uint32_t j) const;
  void offer(Query& query, std::uint32_t j, float d2) const;
  float search(Query& query) const;

  const SurfelTarget* target_;
  const Surfels* source_;
  std::vector<Tracked> tracked_;
  Eigen::Matrix3f R_ = Eigen::Matrix3f::Identity(), R_last_ = R_;
  Eigen::Vector3f t_ = Eigen::Vector3f::Zero(), t_last_ = t_;
  Eigen::Vector3f origin_;
  float gate_, inverse_, margin_;
  double turned_ = 0;  ///< rad, in sum since the first T
  bool oriented_;
};

}  // namespace parhelion::cloud
