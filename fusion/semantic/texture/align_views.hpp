// Poses of colour images, and the lens that they share, refined so that they agree about the surface (Zhou
// and Koltun 2014, without their warp of each image).
#pragma once

#include "fusion/semantic/texture/exposure.hpp"
#include "fusion/semantic/texture/lens_error.hpp"

namespace parhelion::semantic {

struct AlignOptions {
  int rounds = 12;               ///< for each of the blurs
  double sigma_position = 0.05;  ///< m, how far the given poses are trusted
  double sigma_angle = 0.04;     ///< rad
  bool refine_lens = true;
  double sigma_focal = 0.1;  ///< share, how far the given lens is trusted
  double sigma_distortion = 0.2;
  int threads = 0;  ///< 0: all
};

/// Moves the views; their cameras and pixels stay. `samples` are those of the surface, seen from the given
/// poses. Same bits for any number of threads.
LensError align_views(std::span<ColourView> views, std::span<const Eigen::Vector3f> gains,
                      std::span<const SurfaceSample> samples, const AlignOptions& options = {});

}  // namespace parhelion::semantic
