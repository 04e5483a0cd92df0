// Camera of a model's 3D picture. Internal to model_view.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/model.hpp"
#include "render/model_view.hpp"

namespace parhelion::render {

constexpr int kFineness = 2;              ///< rendered pixels per pixel of the picture
constexpr int kTitle = 74, kLegend = 52;  ///< pixels of the picture

struct ModelViewCamera {
  Transform<Map, CameraOptical> T_map_optical;
  CameraIntrinsics intrinsics;
  Eigen::Vector3d forward;
  double scale = 1;  ///< drawn units per metre: the depth buffer is most accurate close to the near plane
};

bool in_model_view(const ModelEntity& entity);

/// Corners of everything drawn, map frame.
std::vector<Eigen::Vector3d> points_in_view(const SemanticModel& model);

/// A camera whose picture is filled by the drawn part (within `extent`) between title and legend.
ModelViewCamera look_at(const SemanticModel& model, const Eigen::AlignedBox3d& extent, const ModelView& view);

}  // namespace parhelion::render
