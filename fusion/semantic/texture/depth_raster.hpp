// Which quad each pixel of a camera sees: a z-buffer.
#pragma once

#include <limits>
#include <vector>

#include "fusion/semantic/texture/quad_surface.hpp"
#include "fusion/semantic/texture/views.hpp"

namespace parhelion::semantic {

struct SeenPixel {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  float depth = 0;  ///< m along the optical axis; 0: nothing
  std::uint32_t quad = kNone;
  float s = 0, t = 0;  ///< place in the quad
};

/// One for each pixel, row by row. Both sides of a quad are seen.
std::vector<SeenPixel> see(const QuadSurface& surface, const Pinhole& camera,
                           const Transform<Map, CameraOptical>& T_map_optical);

}  // namespace parhelion::semantic
