#include "render/compositor.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "render/egl_context.hpp"
#include "tests/render/scenes.hpp"

namespace parhelion::render {
namespace {

using test::jpeg_image;
using test::look;
using test::raw_image;
using test::robot_job;
using test::wall;

std::unique_ptr<Compositor> compositor(const SemanticModel& model = {}) {
  auto made = Compositor::create(model);
  EXPECT_TRUE(made.ok()) << made.error().message;
  return made.ok() ? std::move(*made) : nullptr;
}

TEST(Egl, MissingLibraryNamesThePackages) {
  const auto context = EglContext::create("libEGL-that-is-not-there.so");
  ASSERT_FALSE(context.ok());
  EXPECT_NE(context.error().message.find("libgl1-mesa-dri"), std::string::npos);
  EXPECT_NE(context.error().message.find("libegl1"), std::string::npos);
}

TEST(Compositor, AFrameWithoutVisibleBodiesIsUnchanged) {
  const auto c = compositor();
  ASSERT_TRUE(c);
  RenderJob job = robot_job(jpeg_image());
  for (const double yaw : {0.0, 3.0}) {  // no body at all; a body behind the camera
    if (yaw == 0)
      job.world = {};
    else
      job = robot_job(jpeg_image()), job.T_map_optical = look({0, 0, 0.9}, yaw, 0.1);
    const RenderAnswer answer = c->compose(job);
    EXPECT_FALSE(answer.drawn);
    EXPECT_EQ(answer.reason, "");
    EXPECT_EQ(answer.image.bytes, job.image.bytes);
    EXPECT_TRUE(answer.visible.empty());
  }
}

TEST(Compositor, BodyHiddenByAModelledWallLeavesTheSameBytes) {
  SemanticModel model;
  model.entities = {wall("wall 1", 2, 0, M_PI / 2, 6)};
  const auto c = compositor(model);
  ASSERT_TRUE(c);
  const RenderJob job = robot_job(jpeg_image(), 3.5);
  const RenderAnswer answer = c->compose(job);
  EXPECT_FALSE(answer.drawn);
  EXPECT_EQ(answer.image.bytes, job.image.bytes);
  EXPECT_TRUE(compositor()->compose(job).drawn);
}

TEST(Compositor, KeepsStampFormatAndMetadataAndListsVisibleBodies) {
  const auto c = compositor();
  ASSERT_TRUE(c);
  const RenderJob job = robot_job(jpeg_image());
  const RenderAnswer answer = c->compose(job);
  EXPECT_TRUE(answer.drawn);
  EXPECT_EQ(answer.image.stamp, job.image.stamp);
  EXPECT_EQ(answer.image.format, PixelFormat::mjpeg);
  EXPECT_EQ(answer.image.metadata.size(), 1U);
  EXPECT_EQ(answer.visible, std::vector<std::string>{"red"});
  EXPECT_NE(answer.image.bytes, job.image.bytes);
}

/// The shadow lies in the floor's own plane, whatever of the picture the model explains.
TEST(Compositor, TheModelledFloorHidesNoShadow) {
  SemanticModel model;
  ModelEntity floor = wall("floor", 0, 0, 0, 40, 0.1, EntityLabel::floor);
  floor.T_map_body = Transform<Map, Body>::planar(0, 0, 0, -0.05);  // its top is at z = 0
  floor.size = {40, 40, 0.1};
  model.entities = {floor};
  const auto on_floor = compositor(model), without_model = compositor();
  ASSERT_TRUE(on_floor && without_model);
  for (const double distance : {1.5, 3.0, 6.0}) {
    const RenderJob job = robot_job(raw_image(PixelFormat::bgr), distance);
    const auto a = on_floor->compose_pixels(job), b = without_model->compose_pixels(job);
    ASSERT_TRUE(a.ok() && b.ok());
    const auto covered = [](const auto& pixels) {
      return pixels->mask.size() -
             static_cast<std::size_t>(std::count(pixels->mask.begin(), pixels->mask.end(), 0));
    };
    EXPECT_NEAR(static_cast<double>(covered(a)), static_cast<double>(covered(b)),
                0.01 * static_cast<double>(covered(b)))
        << distance;
  }
}

TEST(Compositor, UncoveredPixelsAreUnchanged) {
  const auto c = compositor();
  ASSERT_TRUE(c);
  const RenderJob job = robot_job(raw_image(PixelFormat::bgr));
  const auto pixels = c->compose_pixels(job);
  ASSERT_TRUE(pixels.ok()) << pixels.error().message;
  std::size_t covered = 0;
  for (std::size_t i = 0; i < pixels->mask.size(); ++i) {
    if (pixels->mask[i]) {
      ++covered;
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(pixels->bgr[3 * i + k], job.image.bytes[3 * i + k]) << i;
  }
  EXPECT_GT(covered, 2000U);
  EXPECT_LT(covered, 60000U);
}

}  // namespace
}  // namespace parhelion::render
