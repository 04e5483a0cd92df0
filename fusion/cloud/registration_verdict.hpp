// Whether an alignment may be believed: a wrong one must not pass as a right one. Five questions, each of
// which compares the clouds with themselves, their noise and their resolution, with nothing absolute.
#pragma once

#include <string>

#include "fusion/cloud/surfel_match.hpp"

namespace parhelion::cloud {

struct AlignmentEvidence {
  double overlap = 0;        ///< share of the source's surfels that lie on the target's surface
  double rms = 0;            ///< m, of those
  double contradiction = 0;  ///< surfels in what the other's scanner saw through, of those that could be; 0
                             ///< where no viewpoint is known
  double ambiguity = 0;  ///< median residual of the partners, of what it would be were all residuals alike
  Matrix6d covariance = Matrix6d::Zero();  ///< as in Registration
  std::string undetermined;  ///< directions that the surfaces do not determine, in words; empty: none
};

struct AlignedPair {
  const SurfelTarget& target;
  const Surfels& source;
  std::span<const Eigen::Vector3d> target_viewpoints, source_viewpoints;
  const Eigen::Isometry3d& T_target_source;
  const PartnerSearch& partners;      ///< at T
  const SurfelMatchOptions& options;  ///< of the last round
};

AlignmentEvidence evidence(const AlignedPair& pair);

/// Empty: believable; else what speaks against it, in words for a person.
std::string objection(const AlignmentEvidence& evidence, double min_overlap);

}  // namespace parhelion::cloud
