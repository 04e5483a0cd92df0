// Updates of the site at run time: depth images are added, modelled entities stay.
#include "server/runtime/live_site.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/model_box.hpp"

namespace parhelion::runtime {
namespace {

constexpr double kWallX = 3, kSideY = -1.5, kRoomHeight = 2.6;  // m, of the room in front of the camera

/// A camera 1 m over the floor, level, with heading `yaw`.
Transform<Map, DepthOptical> camera_at(double x, double y, double yaw) {
  Eigen::Matrix3d R_map_optical;
  R_map_optical.col(0) = Eigen::Vector3d(std::sin(yaw), -std::cos(yaw), 0);
  R_map_optical.col(1) = -Eigen::Vector3d::UnitZ();
  R_map_optical.col(2) = Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0);
  return {Eigen::Quaterniond(R_map_optical), {x, y, 1.0}};
}

DepthCameraDescription depth_camera() {
  DepthCameraDescription camera;
  camera.intrinsics = {320, 240, 260, 260, 159.5, 119.5, {}, {}};
  camera.range_min = 0.3;
  camera.range_max = 8;
  return camera;
}

/// A depth image of a floor, a wall ahead and a wall at the right, taken from `really`; the view's pose is
/// `reported`.
PlacedDepth view(const Transform<Map, DepthOptical>& really, const Transform<Map, DepthOptical>& reported) {
  PlacedDepth result{{}, depth_camera(), reported};
  const CameraIntrinsics& lens = result.camera.intrinsics;
  std::vector<std::uint16_t> millimetres;
  for (int v = 0; v < lens.height; ++v) {
    for (int u = 0; u < lens.width; ++u) {
      const Eigen::Vector3d ray_optical((u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy, 1);
      const Eigen::Vector3d ray = really.rotation() * ray_optical, from = really.translation();
      double depth = 65.535;
      const auto plane = [&](int axis, double at) {
        const double t = (at - from[axis]) / ray[axis];
        const double z = from.z() + t * ray.z();
        if (t > 0 && t < depth && z > -0.01 && z < kRoomHeight) depth = t;
      };
      plane(0, kWallX);
      plane(1, kSideY);
      plane(2, 0);
      millimetres.push_back(static_cast<std::uint16_t>(std::lround(depth < 8 ? 1000 * depth : 0)));
    }
  }
  result.depth.width = lens.width;
  result.depth.height = lens.height;
  result.depth.row_stride = 2 * lens.width;
  result.depth.format = PixelFormat::depth_mm;
  result.depth.bytes.resize(2 * millimetres.size());
  std::memcpy(result.depth.bytes.data(), millimetres.data(), result.depth.bytes.size());
  return result;
}

/// The floor and the wall at the right are known; the wall ahead is not.
SemanticModel known() {
  SemanticModel model;
  model.map_id = "site";
  model.entities = {
      test::model_box("floor 1", EntityLabel::floor, {2, 0, -0.05}, {8, 8, 0.1}),
      test::model_box("wall 1", EntityLabel::wall, {1, kSideY, kRoomHeight / 2}, {6, 0.1, kRoomHeight})};
  return model;
}

std::vector<ModelEntity> added(const SemanticModel& model, EntityLabel label) {
  std::vector<ModelEntity> found;
  for (const ModelEntity& entity : model.entities) {
    if (entity.name.starts_with("live ") && entity.label == label) found.push_back(entity);
  }
  return found;
}

TEST(LiveSite, AddsAnUnmodelledWallAndKeepsTheRest) {
  LiveSite site(known());
  const auto at = camera_at(0, 0, 0);
  const auto model = site.add(view(at, at));
  ASSERT_TRUE(model.ok()) << model.error().message;
  ASSERT_TRUE(model->has_value());
  EXPECT_EQ((*model)->map_id, "site");
  EXPECT_EQ((*model)->entities[0].name, "floor 1");
  EXPECT_EQ((*model)->entities[1].name, "wall 1");
  const auto walls = added(**model, EntityLabel::wall);
  ASSERT_EQ(walls.size(), 1U) << "the wall at the right is modelled already";
  EXPECT_NEAR(walls[0].T_map_body.translation().x(), kWallX, 0.03);
  EXPECT_NEAR(std::abs(walls[0].T_map_body.rotation()(1, 0)), 1, 0.01);
  EXPECT_TRUE(added(**model, EntityLabel::floor).empty());
  EXPECT_TRUE(parse_model(to_yaml(**model), "model").ok());
}

TEST(LiveSite, CorrectsAViewWithAPoseError) {
  LiveSite site(known());
  const auto at = camera_at(0, 0, -0.3);
  ASSERT_TRUE(site.add(view(at, at)).ok());
  const auto really = camera_at(0.2, 0.1, -0.5), reported = camera_at(0.26, 0.06, -0.49);
  const auto model = site.add(view(really, reported));
  ASSERT_TRUE(model.ok()) << model.error().message;
  double worst = 0;  // largest distance of the cloud's points from the three planes
  for (const Eigen::Vector3f& p : site.cloud().points) {
    worst = std::max<double>(
        worst, std::min({std::abs(p.x() - kWallX), std::abs(p.y() - kSideY), std::abs(1.0 * p.z())}));
  }
  EXPECT_LT(worst, 0.03) << "m; the pose was 7 cm off";
}

TEST(LiveSite, ARepeatedViewAddsNothing) {
  LiveSite site(known());
  const auto at = camera_at(0, 0, 0);
  ASSERT_TRUE(site.add(view(at, at)).ok());
  const std::size_t points = site.cloud().size();
  const auto again = site.add(view(at, at));
  ASSERT_TRUE(again.ok()) << again.error().message;
  // Registration moves the view by a millimetre, which adds points that lay just within the spacing.
  EXPECT_LT(site.cloud().size() - points, points / 6);
}

TEST(LiveSite, AnUndecodableImageChangesNothing) {
  LiveSite site(known());
  const auto at = camera_at(0, 0, 0);
  PlacedDepth broken = view(at, at);
  broken.depth.bytes.resize(100);
  const auto refused = site.add(broken);
  ASSERT_FALSE(refused.ok());
  EXPECT_FALSE(refused.error().message.empty());
  EXPECT_TRUE(site.cloud().empty());
}

}  // namespace
}  // namespace parhelion::runtime
