// The colour of a surface from many views, as patches of one image.
#pragma once

#include "fusion/semantic/texture/view_geometry.hpp"

namespace parhelion::semantic {

struct BakeOptions {
  int patch = 8;        ///< texels along a quad's edge; a power of two
  int views = 8;        ///< that a quad's colour comes from, at most: the best ones
  float sharpness = 1;  ///< exponent of the views' weights: higher prefers the best view
  int threads = 0;      ///< 0: all
};

/// A square of the image for each quad, in the quads' order, row by row. The texels at a patch's corners are
/// the quad's corners: neighbours repeat the texels of the common edge, so that no seam shows.
struct BakedSurface {
  int width = 0, height = 0, patch = 0;
  std::vector<std::uint8_t> rgb;
  std::vector<bool> seen;  ///< per quad: some view saw it

  int patches_per_row() const { return width / patch; }
  /// Texel (column, row) of a place in a quad, with fractions; texel centres at integers.
  Eigen::Vector2f texel(std::size_t quad, float s, float t) const;
};

/// `gains`: per view, as from exposure_gains. Same bytes for any number of threads.
BakedSurface bake(const QuadSurface& surface, std::span<const ColourView> views,
                  std::span<const ViewGeometry> geometry, std::span<const Eigen::Vector3f> gains,
                  const BakeOptions& options = {});

}  // namespace parhelion::semantic
