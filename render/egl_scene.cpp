#include "render/egl_scene.hpp"

#include <utility>

namespace parhelion::render {

Result<EglScene> EglScene::open() {
  auto context = EglContext::create();
  if (!context) return context.error();
  auto renderer = LayerRenderer::create(**context);
  if (!renderer) return renderer.error();
  return EglScene{std::move(*context), std::move(*renderer), {}};
}

void EglScene::set_building(const SemanticModel& building) {
  mesh = building_mesh(building);
  renderer->set_mesh(mesh);
  mesh.vertices = {};  // already uploaded to the driver
}

}  // namespace parhelion::render
