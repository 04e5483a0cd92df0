// Shapes that are meshes, for tests.
#pragma once

#include <string>
#include <vector>

#include "protocols/scene.hpp"
#include "tests/box_mesh.hpp"

namespace parhelion::test {

/// The surface of a box, as a shape of kind mesh at the body's origin.
inline Shape box_mesh_shape(const Eigen::Vector3d& size) {
  ModelEntity entity;
  entity.size = size;
  ModelMesh box = box_mesh(entity);
  auto centered = make_shape_mesh(std::move(box.vertices), std::move(box.triangles));
  Shape shape;
  shape.kind = ShapeKind::mesh;
  shape.size = centered->size;
  shape.T_body_shape = Transform<Body, ShapeFrame>(Eigen::Quaterniond::Identity(), centered->center);
  shape.mesh = centered->mesh;
  return shape;
}

/// Text of an STL file: the surface of a box of 1 m x 0.5 m x 0.25 m whose lowest corner is the origin.
inline std::string box_stl() {
  ModelEntity entity;
  entity.size = {1, 0.5, 0.25};
  entity.T_map_body = Transform<Map, Body>(Eigen::Quaterniond::Identity(), entity.size / 2);
  const ModelMesh box = box_mesh(entity);
  std::string text = "solid box\n";
  for (const auto& triangle : box.triangles) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t corner : triangle) {
      const Eigen::Vector3f& v = box.vertices[corner];
      text += "vertex " + std::to_string(v.x()) + " " + std::to_string(v.y()) + " " + std::to_string(v.z()) +
              "\n";
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid box\n";
}

}  // namespace parhelion::test
