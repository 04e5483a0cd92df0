// The drawn layer against the reference: silhouettes through every lens, model occluders, and the kitchen
// with its real ones.
#include "tests/render/reference.hpp"

#include <gtest/gtest.h>

#include "render/jpeg.hpp"
#include "tests/long_run.hpp"
#include "tests/render/kitchen.hpp"
#include "tests/render/kitchen_truth.hpp"

namespace parhelion::render {
namespace {

using namespace test;

/// Deep enough that no shadow appears: only bodies are compared.
constexpr double kNoFloor = -100;

RenderJob shapes_job(const CameraDescription& camera, int robots = 1) {
  World world;
  const Eigen::Vector3f red(0.7F, 0.1F, 0.1F);
  world.add("box", {shape(ShapeKind::box, {0.6, 0.4, 0.5}, {0, 0, 0.25}, red)},
            Transform<Map, Body>::planar(3, 0.9, 0.5));
  world.add("barrel", {shape(ShapeKind::cylinder, {0.3, 0.3, 0.9}, {0, 0, 0.45}, red)},
            Transform<Map, Body>::planar(3.5, 0, 0));
  world.add("person",
            {shape(ShapeKind::capsule, {0.2, 0.2, 1.2}, {0, 0, 0.8}, red),
             shape(ShapeKind::sphere, {0.14, 0.14, 0.14}, {0, 0, 1.7}, red)},
            Transform<Map, Body>::planar(3, -1.0, 0));
  for (int i = 0; i < robots; ++i)
    world.add("robot " + std::to_string(i), robot_shapes(),
              Transform<Map, Body>::planar(2.2 + 0.45 * i, -0.5 + 0.3 * (i % 4), i));
  RenderJob job;
  job.image = raw_image(PixelFormat::bgr, camera.intrinsics.width, camera.intrinsics.height);
  job.camera = camera;
  job.T_map_optical = look({0, 0, 1.1}, 0.03, 0.2);
  job.world = world.snapshot;
  job.floor_z = kNoFloor;
  return job;
}

/// Fraction of wrong pixels further than half a pixel from the reference's silhouette: a pixel is compared
/// only where all eight rays half a pixel around its centre agree.
double wrong_beyond_half_a_pixel(const RenderJob& job, const std::vector<std::uint8_t>& coverage) {
  const CameraIntrinsics& c = job.camera.intrinsics;
  std::vector<int> hits(static_cast<std::size_t>(c.width * c.height), 0);
  int rays = 0;
  for (const double dx : {-0.5, 0.0, 0.5}) {
    for (const double dy : {-0.5, 0.0, 0.5}) {
      if ((dx == 0) != (dy == 0)) continue;
      CameraIntrinsics moved = c;
      moved.cx -= dx, moved.cy -= dy;
      const ReferenceRendering reference = cast(job, {}, moved, job.T_map_optical);
      for (std::size_t i = 0; i < hits.size(); ++i) hits[i] += reference.visible[i];
      ++rays;
    }
  }
  std::size_t wrong = 0, drawn = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    drawn += hits[i] > 0;
    if (hits[i] == 0 && coverage[i] >= 128) ++wrong;
    if (hits[i] == rays && coverage[i] < 128) ++wrong;
  }
  return static_cast<double>(wrong) / static_cast<double>(drawn);
}

CameraDescription lens_camera(CameraIntrinsics::Lens lens, std::array<double, 5> distortion, double f = 262) {
  CameraDescription camera = pinhole(320, 240, f);
  camera.intrinsics.lens = lens;
  camera.intrinsics.distortion = distortion;
  return camera;
}

TEST(ReferenceRendering, SilhouettesAgreeToHalfAPixelThroughEveryLens) {
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  using Lens = CameraIntrinsics::Lens;
  const CameraDescription cameras[] = {
      lens_camera(Lens::radial_tangential, {}),
      lens_camera(Lens::radial_tangential, {-0.35, 0.14, 0.002, -0.001, -0.02}),
      lens_camera(Lens::radial_tangential, {0.2, 0.05, -0.001, 0.001, 0}),
      lens_camera(Lens::fisheye, {-0.02, 0.003, -0.001, 0.0002, 0}),
      lens_camera(Lens::fisheye, {0.01, -0.004, 0, 0, 0}, 110),  // 170 degrees across: faces of a cube
  };
  for (const CameraDescription& camera : cameras) {
    for (const int robots : {1, 9}) {  // few: multisampled; many: the edge filter
      const RenderJob job = shapes_job(camera, robots);
      const auto pixels = (*compositor)->compose_pixels(job);
      ASSERT_TRUE(pixels.ok()) << pixels.error().message;
      const ReferenceRendering reference = cast(job, {}, camera.intrinsics, job.T_map_optical);
      const double iou = overlap(pixels->coverage, reference.visible);
      const double wrong = wrong_beyond_half_a_pixel(job, pixels->coverage);
      RecordProperty("iou", std::to_string(iou));
      std::printf("lens %d f %.0f k1 %.2f, %d robots: IoU %.4f, beyond half a pixel %.5f\n",
                  static_cast<int>(camera.intrinsics.lens), camera.intrinsics.fx,
                  camera.intrinsics.distortion[0], robots, iou, wrong);
      EXPECT_GT(iou, 0.97);
      EXPECT_LT(wrong, 0.004);
    }
  }
}

TEST(ReferenceRendering, ModelledWallsHideAsInTheReference) {
  SemanticModel model;
  model.entities = {wall("a", 2.9, 0.45, M_PI / 2, 0.5, 0.6), wall("b", 2.6, -0.7, 1.2, 0.6, 1.1),
                    wall("behind", 5.5, 0, M_PI / 2, 8)};
  auto compositor = Compositor::create(model);
  ASSERT_TRUE(compositor.ok());
  const RenderJob job =
      shapes_job(lens_camera(CameraIntrinsics::Lens::radial_tangential, {-0.2, 0.05, 0, 0, 0}), 2);
  const auto pixels = (*compositor)->compose_pixels(job);
  ASSERT_TRUE(pixels.ok());
  const ReferenceRendering reference = cast(job, model, job.camera.intrinsics, job.T_map_optical);
  EXPECT_GT(overlap(pixels->coverage, reference.visible), 0.96);
}

/// The robot drives from the open floor to behind chair and table.
class KitchenDrive {
 public:
  explicit KitchenDrive(const Kitchen& kitchen)
      : from_(kitchen.floor_point(0, 140, 300)), to_(kitchen.floor_point(0, 290, 245)) {}
  WorldSnapshot at(double s) const {
    const Eigen::Vector3d p = from_ + s * (to_ - from_), along = to_ - from_;
    World world;
    world.add("robot", robot_shapes({0.1F, 0.35F, 0.7F}),
              Transform<Map, Body>::planar(p.x(), p.y(), std::atan2(along.y(), along.x())));
    return world.snapshot;
  }

 private:
  Eigen::Vector3d from_, to_;
};

// The reference uses the same constants as the tested code: it checks the fast path against the rule, and
// RobotInTheKitchenIsHiddenWhereOtherFramesMeasuredSomethingNearer the rule against the kitchen.
TEST(ReferenceRendering, RobotBehindTableAndSlatsIsHiddenAsInTheReference) {
  const Kitchen kitchen;
  PARHELION_NEEDS_RECORDING(kitchen.folder);
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  const KitchenDrive drive(kitchen);
  const int frames = test::long_run() ? 50 : 12;
  JpegCodec codec;
  std::vector<std::uint8_t> bgr;
  std::vector<bool> before;
  double worst = 1, sum = 0, worst_flicker = 0;
  std::size_t drawn = 0, hidden = 0;
  for (int frame = 0; frame < frames; ++frame) {
    RenderJob job = kitchen.job(frame + 16, drive.at(std::min(1.0, (frame + 16) / 40.0)));
    job.floor_z = kNoFloor;
    ASSERT_TRUE(codec.decode(job.image.bytes, bgr).ok());
    ReferenceRendering reference = cast(job, {}, job.camera.intrinsics, job.T_map_optical);
    const std::size_t unhidden =
        static_cast<std::size_t>(std::count(reference.visible.begin(), reference.visible.end(), 1));
    hide_by_depth(reference, job, bgr);
    const auto pixels = (*compositor)->compose_pixels(job);
    ASSERT_TRUE(pixels.ok()) << pixels.error().message;
    const double iou = overlap(pixels->coverage, reference.visible);
    std::vector<bool> wrong(reference.visible.size());
    std::size_t flips = 0, visible = 0;
    for (std::size_t i = 0; i < wrong.size(); ++i) {
      wrong[i] = (pixels->coverage[i] >= 128) != (reference.visible[i] != 0);
      visible += reference.visible[i];
      if (!before.empty() && wrong[i] != before[i]) ++flips;
    }
    ASSERT_GT(visible, 200U) << "frame " << frame;
    drawn += visible, hidden += unhidden - visible;
    const double flicker = static_cast<double>(flips) / static_cast<double>(unhidden);
    worst = std::min(worst, iou), sum += iou, worst_flicker = std::max(worst_flicker, flicker);
    before = wrong;
  }
  std::printf("kitchen, %d frames: mask IoU mean %.4f worst %.4f, flicker worst %.4f, %.0f %% hidden\n",
              frames, sum / frames, worst, worst_flicker,
              100.0 * static_cast<double>(hidden) / static_cast<double>(drawn + hidden));
  EXPECT_GE(worst, 0.95);
  EXPECT_LE(worst_flicker, 0.01);
  EXPECT_GT(hidden, drawn / 3) << "the kitchen must really hide the robot";
}

TEST(ReferenceRendering, RobotInTheKitchenIsHiddenWhereOtherFramesMeasuredSomethingNearer) {
  const Kitchen kitchen;
  PARHELION_NEEDS_RECORDING(kitchen.folder);
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  const KitchenDrive drive(kitchen);
  const int step = test::long_run() ? 1 : 5;
  std::size_t drawn = 0, hidden = 0, visible = 0, shown = 0, lost = 0;
  for (int frame = 12; frame < 62; frame += step) {
    RenderJob job = kitchen.job(frame, drive.at(std::min(1.0, frame / 40.0)));
    job.floor_z = kNoFloor;
    const auto pixels = (*compositor)->compose_pixels(job);
    ASSERT_TRUE(pixels.ok()) << pixels.error().message;
    const ReferenceRendering bodies = cast(job, {}, job.camera.intrinsics, job.T_map_optical);
    const auto truth = test::seen_by_others(
        kitchen, job, bodies, {frame - 12, frame - 8, frame - 4, frame + 4, frame + 8, frame + 12}, 0.15);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const bool covered = pixels->coverage[i] >= 128;
      drawn += bodies.visible[i];
      hidden += truth[i] == test::Seen::hidden, shown += truth[i] == test::Seen::hidden && covered;
      visible += truth[i] == test::Seen::visible, lost += truth[i] == test::Seen::visible && !covered;
    }
  }
  const auto fraction = [](std::size_t part, std::size_t all) {
    return static_cast<double>(part) / static_cast<double>(std::max<std::size_t>(all, 1));
  };
  std::printf(
      "kitchen: of %zu pixels of the robot %zu must be hidden, %.4f are not; %zu visible, %.4f are not\n",
      drawn, hidden, fraction(shown, hidden), visible, fraction(lost, visible));
  EXPECT_GT(fraction(hidden + visible, drawn), 0.4) << "the truth must judge much of the robot";
  EXPECT_GT(hidden, 10'000U);
  EXPECT_GT(visible, 5'000U);
  // Reached: 0.0039 and 0.0023 of these ten frames, 0.0036 and 0.0102 of all fifty.
  EXPECT_LE(fraction(shown, hidden), 0.005);
  EXPECT_LE(fraction(lost, visible), 0.012);
}

TEST(ReferenceRendering, UncoveredKitchenPixelsAreUnchanged) {
  const Kitchen kitchen;
  PARHELION_NEEDS_RECORDING(kitchen.folder);
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  const KitchenDrive drive(kitchen);
  JpegCodec codec;
  std::vector<std::uint8_t> bgr;
  for (int frame = 0; frame < 40; frame += 5) {
    const RenderJob job = kitchen.job(frame, drive.at(frame / 40.0));
    ASSERT_TRUE(codec.decode(job.image.bytes, bgr).ok());
    const auto pixels = (*compositor)->compose_pixels(job);
    ASSERT_TRUE(pixels.ok());
    std::size_t covered = 0;
    for (std::size_t i = 0; i < pixels->mask.size(); ++i) {
      covered += pixels->mask[i] != 0;
      if (pixels->mask[i]) continue;
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_EQ(pixels->bgr[3 * i + k], bgr[3 * i + k]) << frame << ": " << i;
    }
    EXPECT_GT(covered, 500U);
    EXPECT_LT(covered, 80000U);
  }
}

}  // namespace
}  // namespace parhelion::render
