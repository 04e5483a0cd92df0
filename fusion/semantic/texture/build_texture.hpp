// A site's texture from recorded images: depth images give the surface where they measured, the model the
// rest; colour images with refined poses and equal exposure give the colour.
#pragma once

#include <functional>

#include "fusion/semantic/texture/align_views.hpp"
#include "fusion/semantic/texture/bake.hpp"
#include "fusion/semantic/texture/movers.hpp"
#include "fusion/semantic/texture/surface_volume.hpp"
#include "protocols/model.hpp"
#include "protocols/site_texture.hpp"

namespace parhelion::semantic {

struct TextureOptions {
  VolumeOptions volume;
  BakeOptions bake;
  AlignOptions align;
  MoverOptions movers;
  double cell = 0.10;            ///< m, pieces of the model's surfaces where no depth was measured
  double cell_no_depth = 0.05;   ///< m, the same where there are no depth images at all
  std::size_t samples = 30'000;  ///< places where images are compared
  int threads = 0;               ///< 0: all; also for the parts
};

struct BuiltTexture {
  SiteTexture texture;  ///< without its JPEG
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  ///< the picture, row by row
  std::size_t measured = 0;       ///< quads whose surface was measured
  std::size_t seen = 0;           ///< quads that an image shows
  double moved = 0;               ///< m, median over the images that alignment moved them
  LensError lens;                 ///< what alignment found wrong with the calibration, and has put right
  std::size_t with_movers = 0;    ///< images of which a part was left out, as it shows no part of the site
};

/// `progress`: called with the name of each stage. Errors: no image, a size that is not its camera's, a
/// camera or pose that is not finite, nothing to texture. Same bytes for any number of threads.
Result<BuiltTexture> build_texture(const SemanticModel& model, std::vector<ColourView> views,
                                   std::vector<DepthView> depth, TextureOptions options = {},
                                   const std::function<void(const char*)>& progress = {});

}  // namespace parhelion::semantic
