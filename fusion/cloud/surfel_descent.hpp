// ICP between surfels from the coarsest resolution to the finest.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "fusion/cloud/surfel_match.hpp"

namespace parhelion::cloud {

constexpr int kSurfelResolutions = 4;  ///< each twice as fine as the previous one

/// Surfels of all sizes, the finest first.
using Pyramid = std::vector<Surfels>;
Pyramid pyramid(VoxelMoments finest, int threads);

std::vector<SurfelTarget> targets(const Pyramid& surfels);

struct Level {
  const SurfelTarget& target;
  const Surfels& source;
  SurfelMatchOptions options;
};

/// Finest first; the levels refer to both arguments, which must outlive them.
std::vector<Level> make_levels(const std::vector<SurfelTarget>& target, const Pyramid& source,
                               const RegistrationOptions& options);

struct Descent {
  Eigen::Isometry3d T;
  SurfelMatchOptions options;  ///< of the last round
  PartnerSearch partners;      ///< in the finest level, at T
  int iterations = 0;
  bool settled = false;  ///< the last step was small
  double last_step = 0;  ///< m
};

/// Gauss-Newton from the last level to the first, and once more at the first with the fitted kernel.
/// `max_per_level`: maximum iterations per level.
Descent descend(std::span<const Level> levels, const Eigen::Isometry3d& guess, int max_iterations,
                int max_per_level = 25);

/// Fraction of a level's source surfels that lie on the target; `partners` are those at T.
double agreement(const Level& level, const PartnerSearch& partners, const Eigen::Isometry3d& T);

}  // namespace parhelion::cloud
