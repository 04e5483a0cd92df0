// From where a model is looked at in its solid picture. Internal to model_view.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/model.hpp"
#include "render/model_view.hpp"

namespace parhelion::render {

constexpr int kFineness = 2;              ///< drawn pixels per pixel of the picture
constexpr int kTitle = 74, kLegend = 52;  ///< pixels of the picture

struct ModelViewCamera {
  Transform<Map, CameraOptical> T_map_optical;
  CameraIntrinsics intrinsics;
  Eigen::Vector3d forward;
  double scale = 1;  ///< drawn units per metre: the depth buffer is finest near its near plane
};

bool in_model_view(const ModelEntity& entity);

/// Corners of all that is drawn, map frame.
std::vector<Eigen::Vector3d> points_in_view(const SemanticModel& model);

/// What is drawn (within `extent`) fills the picture between title and legend.
ModelViewCamera look_at(const SemanticModel& model, const Eigen::AlignedBox3d& extent, const ModelView& view);

}  // namespace parhelion::render
