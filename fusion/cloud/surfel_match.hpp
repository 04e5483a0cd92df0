// One round of ICP between surfels: for each of the source its partner in the target, and from all pairs the
// step that brings them together.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "fusion/cloud/bucket_grid.hpp"
#include "fusion/cloud/registration.hpp"
#include "fusion/cloud/surfels.hpp"

namespace parhelion {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// The target's surfels, in the order of the buckets.
struct SurfelTarget {
  SurfelTarget(const Surfels& target, double bucket_size);
  Surfels surfels;
  BucketGrid grid;
};

struct MatchOptions {
  IcpMethod method = IcpMethod::generalised;
  double gate = 1;    ///< m, furthest partner
  double kernel = 1;  ///< m, residual at which a pair has a quarter of its say (Geman and McClure)
  int threads = 1;
};

/// A step x = (t, w) moves a point p to p + t + w x (p - centre), in the target's frame.
struct NormalEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();

  double cost = 0;  ///< m^2, sum of the kernel's values
  double pairs = 0;
  double squares = 0;  ///< m^2, weighed squared residuals
  double weights = 0;

  NormalEquations& operator+=(const NormalEquations& other);
};

/// For each surfel of the source the index of the nearest surfel of the target within the gate that faces the
/// same way; -1: none.
std::vector<std::int32_t> partners(const SurfelTarget& target, const Surfels& source,
                                   const Eigen::Isometry3d& T_target_source, const MatchOptions& options);

/// Metres that a pair is apart as generalised ICP counts it, whatever the method: along the normals for flat
/// surfels.
double residual(const SurfelTarget& target, std::int32_t partner, const Surfels& source, std::size_t i,
                const Eigen::Isometry3d& T_target_source);

NormalEquations normal_equations(const SurfelTarget& target, const Surfels& source,
                                 const std::vector<std::int32_t>& partners,
                                 const Eigen::Isometry3d& T_target_source, const Eigen::Vector3d& centre,
                                 const MatchOptions& options);

/// T moved by the step.
Eigen::Isometry3d stepped(const Eigen::Isometry3d& T, const Vector6d& step, const Eigen::Vector3d& centre);

}  // namespace parhelion
