// A simulated robot's depth camera, against geometry and against the reference's rays.
#include "render/virtual_depth.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render/depth_image.hpp"
#include "tests/box_mesh.hpp"
#include "tests/render/reference.hpp"
#include "tests/render/scenes.hpp"

namespace parhelion::render {
namespace {

using test::shape;
using test::wall;
using test::World;

/// Without errors: it measures the depth to the millimetre.
DepthCameraDescription exact(int width = 160, int height = 120, double f = 140) {
  DepthCameraDescription camera;
  camera.intrinsics = test::pinhole(width, height, f).intrinsics;
  camera.range_min = 0.3, camera.range_max = 6;
  return camera;
}

Transform<Map, DepthOptical> at(const Eigen::Vector3d& eye, double yaw, double pitch) {
  return test::look(eye, yaw, pitch).as<Map, DepthOptical>();
}

class VirtualDepth : public testing::Test {
 protected:
  DepthPixels measure(const SemanticModel& model, const DepthCameraDescription& camera,
                      const Transform<Map, DepthOptical>& T_map_optical, const WorldSnapshot& world = {},
                      std::uint64_t seed = 1) {
    auto made = VirtualDepthCamera::create(model);
    EXPECT_TRUE(made.ok()) << made.error().message;
    image_ = (*made)->measure(camera, T_map_optical, world, SensorTime::from_utime(42), seed, 7);
    auto pixels = decode_depth(image_);
    EXPECT_TRUE(pixels.ok()) << pixels.error().message;
    return pixels ? *pixels : DepthPixels{};
  }
  static int middle(const DepthPixels& pixels) { return of(pixels, pixels.width / 2, pixels.height / 2); }
  static int of(const DepthPixels& pixels, int x, int y) {
    return pixels.millimetres[static_cast<std::size_t>(y * pixels.width + x)];
  }

  Image image_;
};

SemanticModel end_wall(double x) {
  SemanticModel model;
  model.entities = {wall("end", x + 0.06, 0, M_PI / 2, 8)};  // 12 cm thick: its face is at x
  return model;
}

TEST_F(VirtualDepth, WallAndFloorDepthIsAlongTheOpticalAxis) {
  const DepthPixels pixels = measure(end_wall(3), exact(), at({0, 0, 0.8}, 0, 0));
  EXPECT_EQ(image_.format, PixelFormat::depth_mm);
  EXPECT_EQ(image_.stamp, SensorTime::from_utime(42));
  for (int y = 0; y < pixels.height; ++y) {
    const double below = (y - exact().intrinsics.cy) / 140;  // of a metre ahead, m
    const double floor = below > 0 ? 0.8 / below : 1e9;
    if (std::abs(floor - 3) < 0.05) continue;  // the edge between them
    for (int x = 0; x < pixels.width; ++x)
      ASSERT_NEAR(of(pixels, x, y), 1000 * std::min(3.0, floor), 1 + floor / 1000) << x << ", " << y;
  }
}

TEST_F(VirtualDepth, DepthOutOfRangeIsNotMeasured) {
  EXPECT_EQ(middle(measure(end_wall(6.01), exact(), at({0, 0, 0.8}, 0, 0))), 0);
  EXPECT_EQ(middle(measure(end_wall(5.99), exact(), at({0, 0, 0.8}, 0, 0))), 5990);
  EXPECT_EQ(middle(measure(end_wall(0.29), exact(), at({0, 0, 0.8}, 0, 0))), 0);
  EXPECT_EQ(middle(measure(end_wall(0.31), exact(), at({0, 0, 0.8}, 0, 0))), 310);
}

/// The end of a room with its floor, an agent in front of it, and the robot's own arm in view.
struct Site {
  SemanticModel model = end_wall(3.2);
  World world;
  Site() {
    ModelEntity floor = wall("floor", 0, 0, 0, 40, 0.1, EntityLabel::floor);
    floor.size.y() = 40;
    floor.T_map_body = Transform<Map, Body>::planar(0, 0, 0, -0.05);
    model.entities.push_back(floor);
    world.add("red", test::robot_shapes(), Transform<Map, Body>::planar(2, 0.2, 0.6));
    world.add("own arm", {shape(ShapeKind::capsule, {0.04, 0.04, 0.3}, {0, 0, 0}, {1, 0, 0}, 1.2)},
              Transform<Map, Body>::planar(0.6, -0.1, 0, 0.6), BodyOwner::real_robot, false);
  }
};

/// mm, depths met by a pixel's ray, and by the eight around it where a lens may move it by half a pixel.
std::pair<double, double> met(const test::ReferenceRendering& reference, int x, int y, int around) {
  std::pair<double, double> range{test::kMiss, 0};
  for (int v = std::max(y - around, 0); v <= std::min(y + around, reference.height - 1); ++v) {
    for (int u = std::max(x - around, 0); u <= std::min(x + around, reference.width - 1); ++u) {
      const double nearest =
          1000 * std::min(reference.body_z[reference.at(u, v)], reference.model_z[reference.at(u, v)]);
      range = {std::min(range.first, nearest), std::max(range.second, nearest)};
    }
  }
  return range;
}

TEST_F(VirtualDepth, PixelsMeasureTheNearestHitForAnyLens) {
  const Site site;
  for (const bool distorted : {false, true}) {
    DepthCameraDescription camera = exact();
    if (distorted) camera.intrinsics.distortion = {-0.25, 0.05, 0.001, -0.001, 0};
    const auto T_map_optical = at({0, 0, 0.7}, 0.05, 0.2);
    const DepthPixels pixels = measure(site.model, camera, T_map_optical, site.world.snapshot);
    RenderJob job;
    job.world = site.world.snapshot;
    const test::ReferenceRendering reference =
        test::cast(job, site.model, camera.intrinsics, T_map_optical.as<Map, CameraOptical>());
    std::size_t on_bodies = 0, apart = 0;
    for (int y = 0; y < pixels.height; ++y) {
      for (int x = 0; x < pixels.width; ++x) {
        const auto [nearest, farthest] = met(reference, x, y, distorted ? 1 : 0);
        on_bodies += reference.body_z[reference.at(x, y)] < reference.model_z[reference.at(x, y)];
        const int mm = of(pixels, x, y);
        if (farthest > 1000 * camera.range_max && mm == 0) continue;
        apart += mm < nearest - 2 || mm > farthest + 2;
      }
    }
    EXPECT_GT(on_bodies, 1500U);
    EXPECT_LT(apart, pixels.millimetres.size() / (distorted ? 200 : 40))
        << "edges, and round shapes that are drawn as prisms";
  }
}

TEST_F(VirtualDepth, AnAgentInFrontOfAWallIsMeasuredInstead) {
  World world;
  world.add("box_1", {shape(ShapeKind::box, {0.4, 0.4, 0.8})}, Transform<Map, Body>::planar(2.2, 0, 0, 0.4));
  const auto T_map_optical = at({0, 0, 0.5}, 0, 0);
  const DepthPixels bare = measure(end_wall(3), exact(), T_map_optical);
  const DepthPixels pixels = measure(end_wall(3), exact(), T_map_optical, world.snapshot);
  EXPECT_EQ(middle(bare), 3000);
  EXPECT_NEAR(middle(pixels), 2000, 1);
  for (std::size_t i = 0; i < bare.millimetres.size(); ++i)
    ASSERT_LE(pixels.millimetres[i], bare.millimetres[i]) << "never deeper for it";
}

TEST_F(VirtualDepth, MeasuresDoorsAtTheirAngleAndSeesThroughWindows) {
  SemanticModel model = end_wall(4);
  model.entities.push_back(wall("door 1", 2, 0, M_PI / 2, 1, 2.1, EntityLabel::door));
  model.entities.push_back(wall("window 1", 1, 0, M_PI / 2, 1, 2.1, EntityLabel::window));
  const auto T_map_optical = at({0, 0, 0.8}, 0, 0);
  EXPECT_EQ(middle(measure(model, exact(), T_map_optical)), 1940);
  World world;
  world.add("door 1", {shape(ShapeKind::box, {1, 0.12, 2.1})},
            Transform<Map, Body>::planar(2.5, 0.5, 0, 1.05), BodyOwner::building, false);
  auto leaf = std::make_shared<BodyDefinition>(*world.scene->bodies[0]);
  leaf->moves = true;
  world.scene->bodies[0] = leaf;
  EXPECT_EQ(middle(measure(model, exact(), T_map_optical, world.snapshot)), 4000);
}

TEST_F(VirtualDepth, AMeshMeasuresLikeABoxOfItsShape) {
  SemanticModel boxes = end_wall(4);
  boxes.entities.push_back(wall("shelf", 2, 0.2, M_PI / 2, 0.8, 1.0));
  const SemanticModel meshes = test::with_mesh(boxes, "shelf");
  const auto T_map_optical = at({0, 0, 0.8}, 0, 0);
  const DepthPixels a = measure(boxes, exact(), T_map_optical), b = measure(meshes, exact(), T_map_optical);
  EXPECT_EQ(middle(a), 1940);
  std::size_t apart = 0;
  for (std::size_t i = 0; i < a.millimetres.size(); ++i)
    apart += std::abs(a.millimetres[i] - b.millimetres[i]) > 1;
  EXPECT_LE(apart, 10U) << "rounding at the edges";
}

TEST_F(VirtualDepth, SameSeedSameBytesFromEveryCamera) {
  const Site site;
  DepthCameraDescription camera = exact();
  camera.baseline = 0.075, camera.disparity_noise = 0.03, camera.disparity_step = 0.0625;
  const auto T_map_optical = at({0, 0, 0.7}, 0.05, 0.2);
  measure(site.model, camera, T_map_optical, site.world.snapshot);
  const auto once = image_.bytes;
  auto made = VirtualDepthCamera::create(site.model);
  ASSERT_TRUE(made.ok());
  (*made)->measure(exact(80, 60, 70), at({0, 1, 1}, 1, 0), {}, SensorTime{}, 3, 1);  // another history
  const auto again = [&](std::uint64_t seed) {
    return (*made)
        ->measure(camera, T_map_optical, site.world.snapshot, SensorTime::from_utime(42), seed, 7)
        .bytes;
  };
  EXPECT_EQ(again(1), once);
  EXPECT_NE(again(2), once);
}

TEST_F(VirtualDepth, WithoutCalibrationOrPoseThereIsNoImage) {
  auto made = VirtualDepthCamera::create({});
  ASSERT_TRUE(made.ok());
  const auto bytes = [&](const DepthCameraDescription& camera, const Transform<Map, DepthOptical>& where) {
    return (*made)->measure(camera, where, {}, SensorTime{}, 1, 1).bytes;
  };
  EXPECT_TRUE(bytes({}, at({0, 0, 1}, 0, 0)).empty());
  EXPECT_TRUE(bytes(exact(), at({0, NAN, 1}, 0, 0)).empty());
  EXPECT_FALSE(bytes(exact(), at({0, 0, 1}, 0, 0)).empty());
}

}  // namespace
}  // namespace parhelion::render
