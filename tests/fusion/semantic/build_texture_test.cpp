// Textures of a painted room, against its paint.
#include "fusion/semantic/texture/build_texture.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "fusion/semantic/texture/auto_exposure.hpp"
#include "fusion/semantic/texture/depth_holes.hpp"
#include "fusion/semantic/texture/depth_raster.hpp"
#include "fusion/semantic/texture/model_surface.hpp"
#include "tests/fusion/semantic/painted_room.hpp"

namespace parhelion::semantic {
namespace {

using test::PaintedRoom;
using Poses = std::vector<Transform<Map, CameraOptical>>;

struct Recording {
  std::vector<ColourView> colour;
  std::vector<DepthView> depth;
};

Recording record(const Poses& poses, bool with_depth = true) {
  Recording recording;
  std::mt19937 random(5);
  for (const auto& pose : poses) {
    recording.colour.push_back(PaintedRoom::colour(pose));
    if (with_depth) recording.depth.push_back(PaintedRoom::depth(pose, random));
  }
  return recording;
}

/// The same with somebody who walks through the room, three times each way.
Recording record_with_walker(const Poses& poses) {
  Recording recording;
  std::mt19937 random(5);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double along = static_cast<double>(i) / static_cast<double>(poses.size());
    const Eigen::Vector2d walker(0.6 + 2.8 * std::abs(std::fmod(6 * along, 2.0) - 1),
                                 0.7 + 0.3 * std::sin(9 * along));
    recording.colour.push_back(PaintedRoom::colour(poses[i], 1, &walker));
    recording.depth.push_back(PaintedRoom::depth(poses[i], random, &walker));
    recording.colour.back().stamp = recording.depth.back().stamp =
        SensorTime::from_utime(400'000 * static_cast<std::int64_t>(i));
  }
  return recording;
}

/// dB, of what the texture shows in a view against the paint there; `share`: of pixels that it shows.
double quality(const BuiltTexture& built, const Transform<Map, CameraOptical>& pose, double& share) {
  const SiteTexture& texture = built.texture;
  const QuadSurface surface{texture.vertices, {texture.quads.begin(), texture.quads.end()}};
  BakedSurface picture;
  picture.width = built.width, picture.height = built.height, picture.patch = texture.patch;
  const auto pixels = see(surface, PaintedRoom::camera(), pose);
  double squares = 0, count = 0;
  for (int row = 0; row < PaintedRoom::kHeight; ++row) {
    for (int column = 0; column < PaintedRoom::kWidth; ++column) {
      const SeenPixel& pixel = pixels[PaintedRoom::camera().at(column, row)];
      if (pixel.depth <= 0 || texture.looks[pixel.quad] != QuadLook::recorded) continue;
      const Eigen::Vector2f texel = picture.texel(pixel.quad, pixel.s, pixel.t);
      const Eigen::Vector3d truth = PaintedRoom::paint(PaintedRoom::cast(pose, column, row).point);
      const auto at =
          3 * (static_cast<std::size_t>(std::lround(texel.y())) * static_cast<std::size_t>(built.width) +
               static_cast<std::size_t>(std::lround(texel.x())));
      for (std::size_t c = 0; c < 3; ++c) {
        const double off = built.rgb[at + c] - truth[static_cast<Eigen::Index>(c)];
        squares += off * off / 3;
      }
      count += 1;
    }
  }
  share = count / static_cast<double>(pixels.size());
  return 10 * std::log10(255 * 255 * count / squares);
}

/// A view that the round does not have.
Transform<Map, CameraOptical> elsewhere() {
  return PaintedRoom::pose<CameraOptical>({1.3, 1.2, 1.4}, 0.6, 0.2);
}

TEST(BuildTexture, ShowsARoomFromWhereNoImageWasTaken) {
  const Recording recording = record(PaintedRoom::round(24));
  const auto built = build_texture(PaintedRoom::model(), recording.colour, recording.depth);
  ASSERT_TRUE(built) << built.error().message;
  double share = 0;
  EXPECT_GT(quality(*built, elsewhere(), share), 26);
  EXPECT_GT(share, 0.93);
}

TEST(BuildTexture, WithoutDepthPaintsTheModelItself) {
  const Recording recording = record(PaintedRoom::round(24), false);
  const auto built = build_texture(PaintedRoom::model(), recording.colour, {});
  ASSERT_TRUE(built) << built.error().message;
  double share = 0;
  EXPECT_GT(quality(*built, elsewhere(), share), 26);
  EXPECT_GT(share, 0.93);
}

TEST(BuildTexture, WhatNoImageShowsIsMarkedAsUnseen) {
  const Poses ahead = {PaintedRoom::pose<CameraOptical>({0.5, 1.5, 1.2}, 0, 0),
                       PaintedRoom::pose<CameraOptical>({0.6, 1.6, 1.2}, 0.05, 0)};
  const Recording recording = record(ahead);
  const auto built = build_texture(PaintedRoom::model(), recording.colour, recording.depth);
  ASSERT_TRUE(built) << built.error().message;
  double share = 1;
  quality(*built, PaintedRoom::pose<CameraOptical>({3.5, 1.5, 1.2}, std::numbers::pi, 0), share);
  EXPECT_LT(share, 0.3);  // the wall behind the cameras
  quality(*built, ahead[0], share);
  EXPECT_GT(share, 0.9);
}

TEST(BuildTexture, IsTheSameForAnyNumberOfThreads) {
  const Recording recording = record(PaintedRoom::round(8));
  std::vector<std::vector<std::uint8_t>> files;
  for (const int threads : {1, 2, 8}) {
    TextureOptions options;
    options.threads = threads;
    options.volume.voxel = 0.04;
    auto built = build_texture(PaintedRoom::model(), recording.colour, recording.depth, options);
    ASSERT_TRUE(built) << built.error().message;
    built->texture.jpeg = built->rgb;
    files.push_back(pack_site_texture(built->texture));
  }
  EXPECT_EQ(files[0], files[1]);
  EXPECT_EQ(files[0], files[2]);
}

TEST(BuildTexture, BringsMisplacedImagesTogether) {
  const Recording exact = record(PaintedRoom::round(24));
  std::vector<ColourView> moved = exact.colour;
  std::mt19937 random(11);
  std::normal_distribution<double> metres(0, 0.012), radians(0, 0.006);
  for (ColourView& view : moved) {
    const Eigen::Vector3d turn(radians(random), radians(random), radians(random));
    const Eigen::Isometry3d off(Eigen::Translation3d(metres(random), metres(random), metres(random)) *
                                Eigen::AngleAxisd(turn.norm(), turn.normalized()));
    view.T_map_optical = Transform<Map, CameraOptical>(view.T_map_optical.isometry() * off);
  }
  TextureOptions unaligned;
  unaligned.align.rounds = 0;
  const auto before = build_texture({}, moved, exact.depth, unaligned);
  const auto after = build_texture({}, moved, exact.depth);
  ASSERT_TRUE(before.ok() && after.ok());
  double share = 0;
  EXPECT_GT(quality(*after, elsewhere(), share), quality(*before, elsewhere(), share) + 1);
  EXPECT_GT(after->moved, 0.004);
}

TEST(BuildTexture, DifferentExposuresLeaveNoSeams) {
  const Poses poses = PaintedRoom::round(24);
  Recording recording = record(poses);
  for (std::size_t i = 0; i < poses.size(); ++i)
    recording.colour[i] = PaintedRoom::colour(poses[i], i % 2 == 0 ? 0.8 : 1.25);
  const auto built = build_texture({}, recording.colour, recording.depth);
  ASSERT_TRUE(built) << built.error().message;
  double share = 0;
  EXPECT_GT(quality(*built, elsewhere(), share), 25);
}

TEST(BuildTexture, SomebodyWhoWalksThroughLeavesNoTrace) {
  const Poses poses = PaintedRoom::round(36);
  const Recording empty = record(poses), walked = record_with_walker(poses);
  const auto without = build_texture({}, empty.colour, empty.depth);
  const auto with = build_texture({}, walked.colour, walked.depth);
  ASSERT_TRUE(without.ok() && with.ok());
  EXPECT_EQ(without->with_movers, 0U);
  EXPECT_GT(with->with_movers, 5U);
  for (const Transform<Map, CameraOptical>& view : {elsewhere(), poses[0], poses[12], poses[24]}) {
    double seen_without = 0, seen_with = 0;
    const double best = quality(*without, view, seen_without);
    EXPECT_GT(quality(*with, view, seen_with), best - 1);
    EXPECT_GT(seen_with, seen_without - 0.02);
  }
}

TEST(ExposureGains, WhoStandsInFrontOfHalfOfTheViewsColoursNothing) {
  const Poses poses = PaintedRoom::round(24);
  std::vector<ColourView> views;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector2d walker(2 + 0.6 * std::cos(0.3 * static_cast<double>(i)), 0.6);
    views.push_back(PaintedRoom::colour(poses[i], 1, i % 2 == 0 ? &walker : nullptr));
  }
  const QuadSurface surface = surface_of(PaintedRoom::model(), 0.05);
  const auto samples = sample_surface(surface, geometry_of(surface, views, 0), 5000, 0);
  for (const Eigen::Vector3f& gain : exposure_gains(views, samples))
    EXPECT_LT((gain - Eigen::Vector3f::Ones()).cwiseAbs().maxCoeff(), 0.03F) << gain.transpose();
}

TEST(BuildTexture, AWrongFocalLengthIsFoundAndPutRight) {
  Recording recording = record(PaintedRoom::round(24));
  for (ColourView& view : recording.colour) view.camera.fx *= 1.15, view.camera.fy *= 1.15;
  const auto built = build_texture({}, recording.colour, recording.depth);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_NEAR(1.15 * built->lens.focal, 1, 0.01);
  EXPECT_NEAR(built->lens.distortion, 0, 0.02);
  double share = 0;
  EXPECT_GT(quality(*built, elsewhere(), share), 26);
}

TEST(BuildTexture, ADistortionThatNobodyDescribedIsFoundAndPutRight) {
  Recording recording = record(PaintedRoom::round(24));
  for (ColourView& view : recording.colour)
    view = corrected(std::move(view), {1, 0.1});  // what a lens of -0.1 does
  const auto built = build_texture({}, recording.colour, recording.depth);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_NEAR(built->lens.focal, 1, 0.01);
  EXPECT_NEAR(built->lens.distortion, -0.08, 0.03);
  double share = 0;
  EXPECT_GT(quality(*built, elsewhere(), share), 26);
}

TEST(BuildTexture, ARightLensStaysAsItIs) {
  const Recording recording = record(PaintedRoom::round(24));
  const auto built = build_texture({}, recording.colour, recording.depth);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_NEAR(built->lens.focal, 1, 0.003);
  EXPECT_NEAR(built->lens.distortion, 0, 0.005);
}

TEST(BuildTexture, BadInputIsRefusedWithTheReason) {
  const auto fails = [](std::vector<ColourView> colour, const std::vector<DepthView>& depth,
                        const std::string& word) {
    const auto built = build_texture(PaintedRoom::model(), std::move(colour), depth);
    ASSERT_FALSE(built.ok()) << word;
    EXPECT_NE(built.error().message.find(word), std::string::npos) << built.error().message;
  };
  const Recording good = record(PaintedRoom::round(2));
  fails({}, {}, "no colour image");
  std::vector<ColourView> views = good.colour;
  views[1].T_map_optical = Transform<Map, CameraOptical>(Eigen::Quaterniond::Identity(),
                                                         {std::numeric_limits<double>::quiet_NaN(), 0, 0});
  fails(views, good.depth, "colour image 2: its pose is not finite");
  views = good.colour;
  views[0].rgb.pop_back();
  fails(views, good.depth, "colour image 1: its size differs from its camera's");
  fails({{{1, 1, 1, 1, 0, 0}, {}, {1, 2, 3}}}, {}, "1x1");
  views = good.colour;
  views[0].camera.fx = 0;
  fails(views, {}, "not calibrated");
  std::vector<DepthView> depth = good.depth;
  depth[0].millimetres.resize(7);
  fails(good.colour, depth, "depth image 1");
  const auto away = PaintedRoom::pose<CameraOptical>({500, 500, 1}, 0, 0);
  fails({{PaintedRoom::camera(), away, good.colour[0].rgb}}, {}, "no image shows the site");
  const auto empty = build_texture({}, good.colour, {});
  ASSERT_FALSE(empty.ok());
  EXPECT_NE(empty.error().message.find("nothing to texture"), std::string::npos);
}

TEST(FuseDepth, LiesOnTheSurfaces) {
  const QuadSurface surface = fuse_depth(record(PaintedRoom::round(24)).depth);
  ASSERT_GT(surface.quads.size(), 20'000U);
  double squares = 0;
  for (const Eigen::Vector3f& vertex : surface.vertices) {
    const double off = PaintedRoom::distance(vertex.cast<double>());
    squares += off * off / static_cast<double>(surface.vertices.size());
  }
  EXPECT_LT(std::sqrt(squares), 0.012);
}

TEST(FuseDepth, NothingMeasuredIsNoSurface) {
  DepthView empty{PaintedRoom::camera(), {}, std::vector<std::uint16_t>(PaintedRoom::camera().pixels(), 0)};
  EXPECT_TRUE(fuse_depth({}).empty());
  EXPECT_TRUE(fuse_depth({&empty, 1}).empty());
}

TEST(FilledHoles, APlaneIsGuessedExactlyAndAShadowIsBehind) {
  DepthView view{{64, 48, 60, 60, 31.5, 23.5}, {}, {}};
  const auto plane = [](int column, int row) { return 1 / (0.4 + 0.002 * column + 0.001 * row); };
  for (int row = 0; row < 48; ++row)
    for (int column = 0; column < 64; ++column)
      view.millimetres.push_back(static_cast<std::uint16_t>(std::lround(1000 * plane(column, row))));
  for (int row = 20; row < 30; ++row)
    for (int column = 20; column < 40; ++column) view.millimetres[view.camera.at(column, row)] = 0;
  const DepthView holes = filled_holes(view, 10);
  for (int row = 0; row < 48; ++row) {
    for (int column = 0; column < 64; ++column) {
      const std::uint16_t guess = holes.millimetres[view.camera.at(column, row)];
      if (view.millimetres[view.camera.at(column, row)] > 0) {
        EXPECT_EQ(guess, 0);
      } else {
        EXPECT_NEAR(guess, 1000 * plane(column, row), 15) << column << ' ' << row;
      }
    }
  }
  for (int row = 0; row < 48; ++row)
    for (int column = 0; column < 64; ++column)
      view.millimetres[view.camera.at(column, row)] = column < 20 ? 1000 : column < 30 ? 0 : 3000;
  EXPECT_EQ(filled_holes(view, 10).millimetres[view.camera.at(25, 24)], 3000);
}

TEST(ModelSurface, ADoorOnItsHingeIsNoPartOfIt) {
  SemanticModel model = PaintedRoom::model();
  const std::size_t before = surface_of(model, 0.1).quads.size();
  ModelEntity door = model.entities[3];
  door.name = "door 1", door.label = EntityLabel::door;
  door.hinge.emplace();
  model.entities.push_back(door);
  EXPECT_EQ(surface_of(model, 0.1).quads.size(), before);
  const QuadSurface rest = without_moving(surface_of(PaintedRoom::model(), 0.1), model);
  EXPECT_LT(rest.quads.size(), before);
}

TEST(AutoExposure, ADarkerExposureOfBrightPlacesIsLearned) {
  const semantic::Pinhole camera{16, 16, 10, 10, 8, 8};
  std::vector<ColourView> views;
  std::vector<ViewGeometry> geometry;
  std::vector<Eigen::Vector3f> gains;
  for (const double bright : {60.0, 90.0, 120.0, 150.0, 200.0}) {
    // The camera holds its mean at 100: what is twice as bright is shown half as much.
    views.push_back({camera, {}, std::vector<std::uint8_t>(3 * camera.pixels(), 100)});
    geometry.push_back({camera, {}, std::vector<float>(camera.pixels(), 1.F), {}});
    gains.push_back(Eigen::Vector3f::Constant(static_cast<float>(bright / 100)));
  }
  const AutoExposure exposure = fit_auto_exposure(views, geometry, gains);
  EXPECT_NEAR(exposure.slope, 1, 0.05);
  const std::vector<ColourView> one = {views[0]};
  EXPECT_EQ(fit_auto_exposure(one, {geometry.data(), 1}, {gains.data(), 1}).slope, 0);
}

}  // namespace
}  // namespace parhelion::semantic
