// Checks whether an alignment is plausible: a wrong one must not pass as correct. Five tests, each of which
// compares the clouds with themselves, their noise and their resolution; none uses an absolute threshold.
#pragma once

#include <string>

#include "fusion/cloud/surfel_match.hpp"

namespace parhelion::cloud {

struct AlignmentEvidence {
  double overlap = 0;        ///< fraction of the source's surfels that lie on the target's surface
  double rms = 0;            ///< m, of those
  double contradiction = 0;  ///< fraction of checkable surfels that lie in space the other's scanner saw
                             ///< through; 0 without viewpoints
  double ambiguity = 0;      ///< median residual of the partners, relative to that of equal residuals
  Matrix6d covariance = Matrix6d::Zero();  ///< as in Registration
  std::string undetermined;  ///< directions that the surfaces do not determine, as text; empty: none
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

/// Empty: plausible; else the reason against it as readable text.
std::string objection(const AlignmentEvidence& evidence, double min_overlap);

}  // namespace parhelion::cloud
