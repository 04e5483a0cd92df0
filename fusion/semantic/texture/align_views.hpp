// Poses of colour images refined so that they agree about the surface (Zhou and Koltun 2014, without their
// warp of the image).
#pragma once

#include "fusion/semantic/texture/exposure.hpp"

namespace parhelion::semantic {

struct AlignOptions {
  int rounds = 12;               ///< for each of the blurs
  double sigma_position = 0.05;  ///< m, how far the given poses are trusted
  double sigma_angle = 0.04;     ///< rad
  int threads = 0;               ///< 0: all
};

/// Moves the views. `samples` are those of the surface, seen from the given poses. Same bits for any number
/// of threads.
void align_views(std::span<ColourView> views, std::span<const Eigen::Vector3f> gains,
                 std::span<const SurfaceSample> samples, const AlignOptions& options = {});

}  // namespace parhelion::semantic
