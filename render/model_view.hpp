// Renders a semantic model as a 3D picture: from above at an angle, without ceilings, with labels, and with
// the walls in front of the interior cut low.
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
  double yaw = -2.2;                ///< rad, direction of the camera from the middle of the model
  double elevation = 0.85;          ///< rad, over the horizon
  double cut = 0.9;  ///< m over the floor, cut height of walls in front of the interior; 0: no cut
};

struct ModelViewPixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> bgr;   ///< row by row
  std::vector<std::string> named;  ///< entities whose name appears in the picture
};

/// Errors: nothing to draw, coordinates that are not finite, a size out of range, no EGL (with what to
/// install).
Result<ModelViewPixels> draw_model_view(const SemanticModel& model, const ModelView& view);

}  // namespace parhelion::render
