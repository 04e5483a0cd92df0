// People and things that passed during a recording, found by free space: what other images see through is no
// surface of the site.
#pragma once

#include <span>

#include "fusion/semantic/texture/view_geometry.hpp"

namespace parhelion::semantic {

struct MoverOptions {
  double tolerance = 0.06;           ///< m, to which depths at one place agree
  double tolerance_of_depth = 0.02;  ///< the same, share of the depth
  double farthest = 4.5;             ///< m along the optical axis; what is farther has no vote
  std::size_t max_witnesses = 128;   ///< images that are asked about each place
  int threads = 0;                   ///< 0: all
};

/// A mask for each depth image, one byte for each pixel, 1: more of the other images see through what was
/// measured there than measured it, too. Same bits for any number of threads.
std::vector<std::vector<std::uint8_t>> passing(std::span<const DepthView> views, const MoverOptions& options);

/// What a depth image says of each pixel of the colour image that was taken at the same instant. `geometry`:
/// of the colour image; `mover`: of the depth image, as from passing: contradicts, too. Where it measured
/// nothing and most of the others did, somebody may have stood too near; what lies outside its view it agrees
/// with. It may be coarser than the colour image.
std::vector<Witnessed> compare_depth(const ViewGeometry& geometry, const DepthView& depth,
                                     std::span<const std::uint8_t> mover, std::span<const DepthView> others,
                                     const MoverOptions& options);

}  // namespace parhelion::semantic
