// An upright box of a model, for tests.
#pragma once

#include <string>

#include "protocols/model.hpp"

namespace parhelion::test {

inline ModelEntity model_box(const std::string& name, EntityLabel label, const Eigen::Vector3d& centre,
                             const Eigen::Vector3d& size, double yaw = 0) {
  ModelEntity box;
  box.name = name;
  box.label = label;
  box.T_map_body = Transform<Map, Body>::planar(centre.x(), centre.y(), yaw, centre.z());
  box.size = size;
  return box;
}

}  // namespace parhelion::test
