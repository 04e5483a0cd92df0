// Objects of a site's model, for tests.
#pragma once

#include <array>
#include <string>

#include "protocols/model_objects.hpp"
#include "tests/box_mesh.hpp"
#include "tests/model_box.hpp"

namespace parhelion::test {

/// A movable object with its underside at z = `bottom`, m.
inline ModelObject site_object(const std::string& name, ObjectKind kind, double x, double y,
                               const Eigen::Vector3d& size, double bottom = 0) {
  ModelObject object;
  object.name = name;
  object.kind = kind;
  object.T_map_body = Transform<Map, Body>::planar(x, y, 0, bottom + size.z() / 2);
  object.size = size;
  return object;
}

/// The surface of its box.
inline ModelMesh mesh_of(const ModelObject& object) {
  return box_mesh(model_box(object.name, EntityLabel::unknown, object.T_map_body.translation(), object.size,
                            object.T_map_body.yaw()));
}

}  // namespace parhelion::test
