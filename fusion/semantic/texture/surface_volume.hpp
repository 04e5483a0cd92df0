// Depth images with poses fused into one surface: truncated signed distances in a sparse grid (Curless and
// Levoy 1996), the surface by surface nets (Gibson 1998).
#pragma once

#include <span>

#include "fusion/semantic/texture/quad_surface.hpp"
#include "fusion/semantic/texture/views.hpp"

namespace parhelion::semantic {

struct VolumeOptions {
  double voxel = 0.02;         ///< m
  double truncation = 0.10;    ///< m
  double farthest = 4.5;       ///< m along the optical axis; structured light is too noisy beyond
  float min_weight = 0.01F;    ///< of all images that saw a voxel; one at 1 m weighs 1
  float guess_weight = 0.05F;  ///< of a guess in a hole of a depth image, to a measurement; 0: none are made
  std::size_t min_piece = 60;  ///< quads of a connected piece; smaller ones are noise
  int threads = 0;             ///< 0: all
};

/// The surface that the images saw, with the free side outside. Same bits for any number of threads.
QuadSurface fuse_depth(std::span<const DepthView> views, const VolumeOptions& options = {});

}  // namespace parhelion::semantic
