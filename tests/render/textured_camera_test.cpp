// A simulated camera in a recorded site.
#include "render/textured_camera.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "render/colour_image.hpp"
#include "render/site_surface.hpp"
#include "tests/render/scenes.hpp"

namespace parhelion::render {
namespace {

using namespace test;

constexpr std::array<int, 3> kLeft = {200, 40, 60}, kRight = {30, 90, 180};  // rgb

/// A wall at x = 2 m, 2 m wide and high: its left half of one colour, its right half of another; beside it a
/// piece that no image showed.
SiteTexture painted_wall() {
  SiteTexture texture;
  for (const float y : {1.F, 0.F, -1.F, -2.F})
    for (const float z : {0.F, 2.F}) texture.vertices.emplace_back(2.F, y, z);
  texture.quads = {{0, 2, 3, 1}, {2, 4, 5, 3}, {4, 6, 7, 5}};
  texture.looks = {QuadLook::recorded, QuadLook::recorded, QuadLook::unseen};
  texture.patch = 8, texture.patches_per_row = 2;
  std::vector<std::uint8_t> bgr;
  for (int row = 0; row < 16; ++row)
    for (int column = 0; column < 16; ++column)
      for (const std::size_t c : {std::size_t{2}, std::size_t{1}, std::size_t{0}})
        bgr.push_back(static_cast<std::uint8_t>(column < 8 ? kLeft[c] : kRight[c]));
  JpegCodec codec;
  texture.jpeg = *codec.encode(bgr, {16, 16, 98, JpegFormat::Subsampling::yuv444});
  return texture;
}

class TexturedCamera : public ::testing::Test {
 protected:
  void draw(const SiteTexture& texture, const WorldSnapshot& world = {}, const SemanticModel& model = {}) {
    auto camera = create_virtual_camera(model, &texture);
    ASSERT_TRUE(camera.ok()) << camera.error().message;
    image_ = (*camera)->render(pinhole(320, 240, 200), look({0, 0, 1}, 0, 0), world, SensorTime{}, "");
    auto pixels = decode_colour(image_);
    ASSERT_TRUE(pixels.ok()) << pixels.error().message;
    pixels_ = std::move(*pixels);
  }
  /// The colour of the point (2, y, z).
  std::array<int, 3> at(double y, double z) const {
    const auto column = static_cast<std::size_t>(std::lround(159.5 - 200 * y / 2));
    const auto row = static_cast<std::size_t>(std::lround(119.5 - 200 * (z - 1) / 2));
    const std::uint8_t* p = &pixels_.rgb[3 * (320 * row + column)];
    return {p[0], p[1], p[2]};
  }
  static void expect_near(const std::array<int, 3>& a, const std::array<int, 3>& b, int tolerance = 8) {
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance) << c;
  }

  Image image_;
  ColourPixels pixels_;
};

TEST_F(TexturedCamera, ShowsEachPieceInItsRecordedColour) {
  draw(painted_wall());
  expect_near(at(0.5, 1.3), kLeft);
  expect_near(at(0.5, 0.4), kLeft);
  expect_near(at(-0.5, 1.3), kRight);
  ASSERT_NE(image_.find_metadata("texture"), nullptr);
  EXPECT_EQ(image_.find_metadata("texture")->value.size(), 16U);
}

TEST_F(TexturedCamera, WhatNoImageShowedHasGreyStripes) {
  draw(painted_wall());
  std::set<int> greys;
  for (double z = 0.5; z < 1.5; z += 0.02) {
    const auto colour = at(-1.4, z);
    EXPECT_NEAR(colour[0], colour[1], 6);
    EXPECT_NEAR(colour[1], colour[2], 6);
    greys.insert(colour[0] / 10);
  }
  EXPECT_GE(greys.size(), 2U);
}

TEST_F(TexturedCamera, ABodyStandsInTheSite) {
  World world;
  world.add("box", {shape(ShapeKind::box, {0.4, 0.4, 0.4}, {0, 0, 0}, {0.02F, 0.9F, 0.02F})},
            Transform<Map, Body>::planar(1.2, 0.3, 0, 1.0));
  draw(painted_wall(), world.snapshot);
  const auto box = at(0.5, 1.0);
  EXPECT_GT(box[1], box[0] + 60);
  expect_near(at(0.5, 1.8), kLeft);
}

TEST_F(TexturedCamera, TheModelsWallDoesNotCoverTheRecordedOneButAMovedDoorIsDrawn) {
  SemanticModel model;
  model.entities = {wall("wall 1", 1.9, 0, M_PI / 2, 6),
                    wall("door 1", 1.8, 0, M_PI / 2, 1, 2, EntityLabel::door)};
  draw(painted_wall(), {}, model);
  expect_near(at(0.7, 1.3), kLeft);
  model.entities[1].hinge.emplace();
  draw(painted_wall(), {}, model);
  const auto door = at(0.3, 1.3);
  EXPECT_GT(std::abs(door[0] - kLeft[0]) + std::abs(door[2] - kLeft[2]), 60);
  expect_near(at(0.9, 1.3), kLeft);
}

TEST_F(TexturedCamera, ExposesAsTheRecordingCameraDid) {
  SiteTexture texture = painted_wall();
  texture.exposure.slope = 1;
  texture.exposure.luminance = std::log(60.F);
  draw(texture);
  const double mean = 0.5 * (0.299 * (kLeft[0] + kRight[0]) + 0.587 * (kLeft[1] + kRight[1]) +
                             0.114 * (kLeft[2] + kRight[2]));
  EXPECT_NEAR(at(0.5, 1.3)[0], kLeft[0] * 60 / mean, 10);
  texture.exposure.slope = 0;
  texture.exposure.gain = {std::log(2.F), 0, 0};
  draw(texture);
  EXPECT_NEAR(at(0.5, 1.3)[0], kLeft[0] / 2, 8);
  EXPECT_NEAR(at(0.5, 1.3)[2], kLeft[2], 8);
}

TEST_F(TexturedCamera, TheSameViewHasTheSameBytes) {
  draw(painted_wall());
  const std::vector<std::uint8_t> first = image_.bytes;
  draw(painted_wall());
  EXPECT_EQ(image_.bytes, first);
}

TEST_F(TexturedCamera, ADamagedPictureIsRefused) {
  SiteTexture texture = painted_wall();
  texture.jpeg.resize(texture.jpeg.size() / 2);
  EXPECT_FALSE(create_virtual_camera({}, &texture).ok());
  texture = painted_wall();
  texture.patches_per_row = 3;
  const auto wrong = create_virtual_camera({}, &texture);
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().message.find("another size"), std::string::npos) << wrong.error().message;
}

TEST(ColourImage, ALensIsTakenOut) {
  CameraIntrinsics lens = pinhole(160, 120, 120).intrinsics;
  EXPECT_TRUE(unwarp(lens).source.empty());
  lens.distortion = {-0.25, 0.06, 0, 0, 0};
  const Unwarp straight = unwarp(lens);
  ASSERT_EQ(straight.source.size(), 160U * 120U);
  const Lens model(lens);
  for (const auto& [x, y] :
       std::vector<std::pair<int, int>>{{0, 0}, {159, 0}, {80, 60}, {20, 100}, {159, 119}}) {
    const auto pixel = model.project(
        {(x - straight.view.cx) / straight.view.fx, (y - straight.view.cy) / straight.view.fy, 1});
    ASSERT_TRUE(pixel.has_value());
    const Eigen::Vector2f& source = straight.source[static_cast<std::size_t>(160 * y + x)];
    EXPECT_NEAR(source.x(), pixel->x(), 1e-3);
    EXPECT_NEAR(source.y(), pixel->y(), 1e-3);
    EXPECT_TRUE(source.x() >= 0 && source.y() >= 0 && source.x() <= 159 && source.y() <= 119);
  }
}

}  // namespace
}  // namespace parhelion::render
