// A box as a mesh: what a box entity and a mesh must do alike.
#pragma once

#include "protocols/model.hpp"

namespace parhelion::test {

/// The surface of the entity's box, twelve triangles, counter-clockwise from outside.
inline ModelMesh box_mesh(const ModelEntity& entity) {
  ModelMesh mesh;
  mesh.name = entity.name;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
    mesh.vertices.emplace_back(
        (entity.T_map_body * Eigen::Vector3d(sign.cwiseProduct(entity.size))).cast<float>());
  }
  for (const auto& [a, b, c, d] : {std::array<std::uint32_t, 4>{0, 2, 3, 1},
                                   {4, 5, 7, 6},
                                   {0, 1, 5, 4},
                                   {2, 6, 7, 3},
                                   {0, 4, 6, 2},
                                   {1, 3, 7, 5}}) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  return mesh;
}

/// The same model with this entity as a mesh.
inline SemanticModel with_mesh(SemanticModel model, const std::string& name) {
  for (std::size_t i = 0; i < model.entities.size(); ++i) {
    if (model.entities[i].name != name) continue;
    model.meshes.push_back(box_mesh(model.entities[i]));
    model.entities.erase(model.entities.begin() + static_cast<std::ptrdiff_t>(i));
    break;
  }
  return model;
}

}  // namespace parhelion::test
