// Objects and doubtful parts in a plan. Internal to the pictures.
#pragma once

#include "fusion/semantic/pictures/plan_canvas.hpp"
#include "fusion/semantic/pictures/plan_labels.hpp"
#include "fusion/semantic/pictures/plan_legend.hpp"
#include "fusion/semantic/pictures/plan_outline.hpp"
#include "protocols/model.hpp"
#include "protocols/model_objects.hpp"

namespace parhelion::semantic {

/// Lines at 45 degrees over a convex part of the map frame, `spacing` pixels apart.
void hatch(PlanCanvas& canvas, const Outline& convex, Colour colour, double spacing);

/// The boxes of objects that reach below a person's head, with their names: the larger first, as far as there
/// is room. The legend counts those without a name.
void paint_objects(const ModelRemarks& remarks, PlanCanvas& canvas, PlanLabels& labels, PlanLegend& legend);

/// Doubtful parts, hatched.
void paint_doubts(const SemanticModel& model, const ModelRemarks& remarks, PlanCanvas& canvas,
                  PlanLegend& legend);

/// Coordinates of the map along the lower and the left edge, m.
void paint_coordinates(const Eigen::AlignedBox2d& view, PlanCanvas& canvas);

}  // namespace parhelion::semantic
