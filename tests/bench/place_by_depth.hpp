// Where a camera was, by its depth image: the poses of a recording may be centimetres off.
#pragma once

#include "fusion/semantic/texture/quad_surface.hpp"
#include "fusion/semantic/texture/views.hpp"

namespace parhelion::bench {

/// The pose from which the depth image fits the surface best, from the given one within about 0.1 m and 3
/// degrees: steps from points to planes (Chen and Medioni 1992), partners by projection (Blais and Levine
/// 1995). The given pose where too little of the surface is in view.
Transform<Map, DepthOptical> place_by_depth(const semantic::DepthView& view,
                                            const semantic::QuadSurface& surface);

}  // namespace parhelion::bench
