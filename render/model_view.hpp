// A semantic model as a solid picture for people: from above at an angle, ceilings left out, the walls that
// stand before the inside cut low, names on what is named.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocols/model.hpp"
#include "protocols/status.hpp"

namespace parhelion::render {

struct ModelView {
  std::string title;  ///< ASCII
  std::string subtitle;
  int width = 1600, height = 1000;  ///< pixels
  double yaw = -2.2;                ///< rad, where the camera stands as seen from the middle of the model
  double elevation = 0.85;          ///< rad, over the horizon
  double cut = 0.9;  ///< m over the floor, to which walls before the inside are cut; 0: none is
};

struct ModelViewPixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> bgr;   ///< row by row
  std::vector<std::string> named;  ///< entities whose name stands in the picture
};

/// Errors: nothing to draw, coordinates that are not finite, a size out of range, no EGL (with what to
/// install).
Result<ModelViewPixels> draw_model_view(const SemanticModel& model, const ModelView& view);

}  // namespace parhelion::render
