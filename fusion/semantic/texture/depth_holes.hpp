// A guess at the depth where a depth camera measured none: dark and shining surfaces, shadows of its light.
#pragma once

#include "fusion/semantic/texture/views.hpp"

namespace parhelion::semantic {

/// Only the holes of a depth image, filled: between their borders along row and column, linear in the inverse
/// of the depth, which is exact for a plane; where the borders lie at different depths, the farther one, as a
/// nearer object throws the shadow. 0 where something was measured, and where a hole has no two borders.
DepthView filled_holes(const DepthView& view, double farthest);

}  // namespace parhelion::semantic
