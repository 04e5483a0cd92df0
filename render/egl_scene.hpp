// A GL context and the renderer that draws in it, with the mesh of a building.
#pragma once

#include <memory>

#include "protocols/model.hpp"
#include "protocols/status.hpp"
#include "render/building_mesh.hpp"
#include "render/egl_context.hpp"
#include "render/layer_renderer.hpp"

namespace parhelion::render {

struct EglScene {
  std::unique_ptr<EglContext> context;
  std::unique_ptr<LayerRenderer> renderer;  ///< draws in `context`, which must outlive it
  BuildingMesh mesh;                        ///< its chunks; the vertices are in the driver

  /// Error: no context, or the driver refuses the renderer's resources.
  static Result<EglScene> open();
  /// Uploads the mesh of the model.
  void set_building(const SemanticModel& building);
};

}  // namespace parhelion::render
