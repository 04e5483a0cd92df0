#include "render/model_view_camera.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::render {
namespace {

constexpr double kFocal = 2.4;  ///< of the picture's width: nearly parallel projection

}  // namespace

bool in_model_view(const ModelEntity& e) {
  return is_solid(e) && e.label != EntityLabel::ceiling && e.T_map_body.finite() && e.size.allFinite() &&
         e.size.minCoeff() > 0;
}

std::vector<Eigen::Vector3d> points_in_view(const SemanticModel& model) {
  std::vector<Eigen::Vector3d> points;
  for (const ModelEntity& entity : model.entities) {
    if (!in_model_view(entity)) continue;
    const Eigen::AlignedBox3d box(-entity.size / 2, entity.size / 2);
    for (int i = 0; i < 8; ++i)
      points.emplace_back(entity.T_map_body * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)));
  }
  for (const ModelMesh& mesh : model.meshes) {
    for (const Eigen::Vector3f& v : mesh.vertices) points.emplace_back(v.cast<double>());
  }
  return points;
}

ModelViewCamera look_at(const SemanticModel& model, const Eigen::AlignedBox3d& extent,
                        const ModelView& view) {
  ModelViewCamera camera;
  const double radius = std::max(0.5, extent.sizes().norm() / 2);
  camera.forward = -Eigen::Vector3d(std::cos(view.elevation) * std::cos(view.yaw),
                                    std::cos(view.elevation) * std::sin(view.yaw), std::sin(view.elevation));
  const Eigen::Vector3d right = camera.forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d R;
  R << right, camera.forward.cross(right), camera.forward;
  const double distance = 2.2 * kFocal * radius;
  const Eigen::Vector3d eye = extent.center() - distance * camera.forward;
  camera.T_map_optical = Transform<Map, CameraOptical>(Eigen::Quaterniond(R), eye);
  camera.scale = 2 / distance;
  Eigen::AlignedBox2d seen;  // at focal length 1
  const Transform<CameraOptical, Map> T_optical_map = camera.T_map_optical.inverse();
  for (const Eigen::Vector3d& p_map : points_in_view(model)) {
    const Eigen::Vector3d p = T_optical_map * p_map;
    seen.extend(Eigen::Vector2d(p.head<2>() / p.z()));
  }
  CameraIntrinsics& c = camera.intrinsics;
  c.width = view.width * kFineness;
  c.height = view.height * kFineness;
  const double room_x = 0.92 * c.width, room_y = 0.92 * (view.height - kTitle - kLegend) * kFineness;
  c.fx = c.fy = std::min(room_x / seen.sizes().x(), room_y / seen.sizes().y());
  c.cx = c.width / 2.0 - c.fx * seen.center().x();
  c.cy = (kTitle + (view.height - kTitle - kLegend) / 2.0) * kFineness - c.fy * seen.center().y();
  return camera;
}

}  // namespace parhelion::render
