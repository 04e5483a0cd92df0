// Draws the plan of a semantic model: a colour per label, dimensions, unobserved parts hatched.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocols/model.hpp"
#include "protocols/model_objects.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

struct ModelPlan {
  std::string title;  ///< ASCII; other characters are drawn as '?'
  std::string subtitle;
  int width = 1600;           ///< pixels; the height follows from the content
  ModelRemarks remarks = {};  ///< objects are drawn with their names, doubtful parts hatched
};

struct ModelPlanPixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> bgr;  ///< row by row
};

/// Names and lengths of walls, widths of doors in metres, rises of stairs; the map's axes, and its
/// coordinates along the edges. Errors: nothing to draw, coordinates that are not finite, a width out of
/// range.
Result<ModelPlanPixels> draw_model_plan(const SemanticModel& model, const ModelPlan& plan);

/// Writes it as PNG. Errors: the same, and a path that cannot be written.
Status draw_model_plan(const SemanticModel& model, const ModelPlan& plan, const std::string& path);

}  // namespace parhelion::semantic
