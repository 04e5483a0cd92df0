// The surface of a semantic model where depth images did not measure: what a texture shows there.
#pragma once

#include <span>

#include "fusion/semantic/texture/quad_surface.hpp"
#include "fusion/semantic/texture/views.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {

/// Faces of the model's boxes in cells of about `cell` (m), and its meshes; without virtual entities, windows
/// and what moves.
QuadSurface surface_of(const SemanticModel& model, double cell);

/// Without the quads whose middle is near the measured surface, or was seen through by depth images: there
/// the model is only a coarser opinion.
QuadSurface unmeasured(const QuadSurface& model, const QuadSurface& measured,
                       std::span<const DepthView> views, int threads);

/// Without the quads in the boxes of what moves.
QuadSurface without_moving(const QuadSurface& surface, const SemanticModel& model);

}  // namespace parhelion::semantic
