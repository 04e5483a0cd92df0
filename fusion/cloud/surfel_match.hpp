// One iteration of ICP between surfels: finds the partner of each source surfel in the target, and from all
// pairs the step that aligns them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "fusion/cloud/partner_search.hpp"
#include "fusion/cloud/registration.hpp"
#include "fusion/cloud/surfels.hpp"

namespace parhelion::cloud {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

struct SurfelMatchOptions {
  IcpMethod method = IcpMethod::generalised;
  double gate = 1;    ///< m, largest distance of a partner; at most 2.5 of the target's buckets
  double kernel = 1;  ///< m, residual at which a pair's robust-kernel weight is a quarter (Geman and McClure)
  int threads = 1;
};

/// A step x = (t, w) moves a point p to p + t + w x (p - centre), in the target's frame.
struct NormalEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();

  double pairs = 0;

  NormalEquations& operator+=(const NormalEquations& other);
};

/// Partners at T.
void find_partners(PartnerSearch& search, const Surfels& source, const Eigen::Isometry3d& T_target_source,
                   int threads);

/// Distance of each source surfel to its partner, m, as in generalised ICP whatever the method: along the
/// normals for flat surfels. Negative: no partner. `partners`: those at T.
std::vector<double> residuals(const SurfelTarget& target, const Surfels& source,
                              const PartnerSearch& partners, const Eigen::Isometry3d& T_target_source,
                              int threads);

/// One iteration: partners at T, and their equations.
NormalEquations match(const SurfelTarget& target, const Surfels& source,
                      const Eigen::Isometry3d& T_target_source, const Eigen::Vector3d& centre,
                      const SurfelMatchOptions& options, PartnerSearch& search);

/// T after the step.
Eigen::Isometry3d stepped(const Eigen::Isometry3d& T, const Vector6d& step, const Eigen::Vector3d& centre);

}  // namespace parhelion::cloud
