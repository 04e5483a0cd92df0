// Depth output, scan as an occluder, the simulated camera, and equal results from run to run.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "render/depth_image.hpp"
#include "tests/box_mesh.hpp"
#include "tests/render/scenes.hpp"
#include "tests/shape_mesh.hpp"

namespace parhelion::render {
namespace {

using namespace test;

/// A flat real scene at `metres`, with a band of holes and a near post.
RenderJob depth_job(double metres, const std::string& encoding = "raw") {
  RenderJob job = robot_job(jpeg_image(), 3);
  DepthPixels pixels{640, 480,
                     std::vector<std::uint16_t>(640 * 480, static_cast<std::uint16_t>(metres * 1000))};
  for (std::size_t y = 0; y < 480; ++y) {
    for (std::size_t x = 0; x < 640; ++x) {
      if (y % 60 < 6) pixels.millimetres[640 * y + x] = 0;
      if (x >= 330 && x < 350) pixels.millimetres[640 * y + x] = 1200;
    }
  }
  Image like;
  like.stamp = job.image.stamp;
  like.format = PixelFormat::depth_mm;
  like.metadata = {{"encoding", {encoding.begin(), encoding.end()}}};
  job.depth = encode_depth(pixels, like).value();
  job.depth_camera.intrinsics = job.camera.intrinsics;
  job.depth_camera.range_min = 0.4, job.depth_camera.range_max = 8;
  job.T_map_depth = job.T_map_optical.as<Map, DepthOptical>();
  return job;
}

std::size_t visible_pixels(Compositor& compositor, const RenderJob& job) {
  const auto pixels = compositor.compose_pixels(job);
  EXPECT_TRUE(pixels.ok()) << pixels.error().message;
  if (!pixels.ok()) return 0;
  return static_cast<std::size_t>(std::count(pixels->mask.begin(), pixels->mask.end(), 255));
}

TEST(MrDepth, ChangesOnlyWhereABodyIsNearer) {
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  for (const std::string encoding : {"raw", "png", "zlib"}) {
    const RenderJob job = depth_job(4, encoding);
    const RenderAnswer answer = (*compositor)->compose(job);
    ASSERT_TRUE(answer.depth) << answer.reason;
    EXPECT_EQ(answer.depth->stamp, job.depth->stamp);
    const auto before = decode_depth(*job.depth).value(), after = decode_depth(*answer.depth).value();
    std::size_t nearer = 0, filled = 0;
    for (std::size_t i = 0; i < before.millimetres.size(); ++i) {
      if (before.millimetres[i]) {
        ASSERT_LE(after.millimetres[i], before.millimetres[i]);
      }
      if (before.millimetres[i] == 1200) {
        ASSERT_EQ(after.millimetres[i], 1200);
      }
      nearer += before.millimetres[i] && after.millimetres[i] < before.millimetres[i];
      filled += !before.millimetres[i] && after.millimetres[i];
      if (after.millimetres[i] != before.millimetres[i]) {
        ASSERT_GT(after.millimetres[i], 2400);  // the robot stands at 3 m
        ASSERT_LT(after.millimetres[i], 3500);
      }
    }
    EXPECT_GT(nearer, 3000U);
    EXPECT_GT(filled, 100U);
  }
}

TEST(MrDepth, IsTheSameWithoutAPictureBesideIt) {
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  RenderJob job = depth_job(4);
  const RenderAnswer both = (*compositor)->compose(job);
  job.image = {};
  const RenderAnswer alone = (*compositor)->compose(job);
  EXPECT_EQ(alone.reason, "");
  EXPECT_FALSE(alone.drawn);
  EXPECT_TRUE(alone.depth_drawn);
  EXPECT_TRUE(alone.image.bytes.empty());
  ASSERT_TRUE(alone.depth && both.depth);
  EXPECT_NE(alone.depth->bytes, job.depth->bytes);
  EXPECT_EQ(alone.depth->bytes, both.depth->bytes);
  job.depth_answered = true;
  EXPECT_FALSE((*compositor)->compose(job).depth);
}

TEST(MrDepth, WithoutVisibleBodiesBytesAreUnchanged) {
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  RenderJob job = depth_job(1.0);
  for (auto& byte : job.depth->bytes) byte = 3;  // 771 mm everywhere: the robot is behind
  const RenderAnswer answer = (*compositor)->compose(job);
  ASSERT_TRUE(answer.depth);
  EXPECT_EQ(answer.depth->bytes, job.depth->bytes);
  EXPECT_FALSE(answer.drawn);
  EXPECT_FALSE(answer.depth_drawn);
  EXPECT_EQ(answer.image.bytes, job.image.bytes);
}

TEST(MrDepth, HoleBehindAModelledWallStaysAHole) {
  SemanticModel model;
  model.entities = {wall("wall 1", 2, 0, M_PI / 2, 6)};
  auto compositor = Compositor::create(model);
  ASSERT_TRUE(compositor.ok());
  const RenderJob job = depth_job(4);
  const auto before = decode_depth(*job.depth).value();
  const auto after = decode_depth(*(*compositor)->compose(job).depth).value();
  for (std::size_t i = 0; i < before.millimetres.size(); ++i)
    if (!before.millimetres[i]) {
      ASSERT_EQ(after.millimetres[i], 0);
    }
}

TEST(Occlusion, NearerDepthHidesAndFartherDepthDoesNot) {
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  RenderJob bare = depth_job(6);
  bare.depth.reset();
  bare.floor_z = -100;
  RenderJob far = depth_job(6), near = depth_job(1.5);
  far.floor_z = near.floor_z = -100;
  const std::size_t all = visible_pixels(**compositor, bare), behind = visible_pixels(**compositor, far);
  EXPECT_GT(behind, all * 6 / 10);  // the post hides the rest
  EXPECT_LT(behind, all);
  EXPECT_EQ(visible_pixels(**compositor, near), 0U);
}

TEST(Occlusion, UnexplainedLaserReturnsHideBodies) {
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  RenderJob job = robot_job(jpeg_image(), 3);
  const std::size_t all = visible_pixels(**compositor, job);
  Scan scan;
  scan.angle_min = -0.5F, scan.angle_increment = 0.01F;
  scan.ranges.assign(101, 1.5F);
  job.laser.convention.range_max = 30;
  job.T_map_laser = Transform<Map, Laser>::planar(0, 0, 0, 0.3);
  job.scan = scan;
  EXPECT_EQ(visible_pixels(**compositor, job), 0U);
  job.scan->ranges.assign(101, 8.F);  // behind the robot
  EXPECT_EQ(visible_pixels(**compositor, job), all);
  job.scan->ranges.assign(101, 60.F);  // no return
  EXPECT_EQ(visible_pixels(**compositor, job), all);
  for (auto& range : job.scan->ranges) range = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(visible_pixels(**compositor, job), all);
  SemanticModel low;  // the model explains the returns as a low wall
  low.entities = {wall("low", 1.5, 0, M_PI / 2, 4, 0.2)};
  auto explained = Compositor::create(low);
  ASSERT_TRUE(explained.ok());
  job.scan->ranges.assign(101, 1.5F);
  EXPECT_GT(visible_pixels(**explained, job), all / 2);
}

TEST(Occlusion, AMeshHidesTheSameAsABoxOfItsShape) {
  for (const double x : {1.5, 2.0}) {
    SemanticModel boxes;
    boxes.entities = {wall("shelf", x, 0.4, M_PI / 2, 0.8, 1.0)};
    const SemanticModel meshes = test::with_mesh(boxes, "shelf");
    auto by_boxes = Compositor::create(boxes), by_meshes = Compositor::create(meshes),
         bare = Compositor::create({});
    ASSERT_TRUE(by_boxes.ok() && by_meshes.ok() && bare.ok());
    const RenderJob job = robot_job(jpeg_image(), 3);
    const auto a = (*by_boxes)->compose_pixels(job), b = (*by_meshes)->compose_pixels(job);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_LT(visible_pixels(**by_boxes, job), visible_pixels(**bare, job)) << "it hides something";
    EXPECT_GT(visible_pixels(**by_boxes, job), 0U) << "and not everything";
    std::size_t apart = 0;
    for (std::size_t i = 0; i < a->mask.size(); ++i) apart += a->mask[i] != b->mask[i];
    EXPECT_LE(apart, 10U) << "rounding at the edges";
  }
}

TEST(Occlusion, AnotherRobotsMeshHidesTheSameAsABoxOfItsShape) {
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  const Eigen::Vector3d size(0.2, 0.5, 1);
  std::vector<std::size_t> counts;
  for (const Shape& hiding : {shape(ShapeKind::box, size), test::box_mesh_shape(size)}) {
    World world;
    world.add("red", robot_shapes(), Transform<Map, Body>::planar(3, 0, 0.6));
    world.add("real", {hiding}, Transform<Map, Body>::planar(1.5, 0.2, 0, 0.5), BodyOwner::real_robot, false);
    RenderJob job = robot_job(jpeg_image(), 3);
    job.world = world.snapshot;
    for (auto& body : job.world.bodies) body.known = true;
    counts.push_back(visible_pixels(**compositor, job));
  }
  const std::size_t all = visible_pixels(**compositor, robot_job(jpeg_image(), 3));
  EXPECT_LT(counts[0], all - 500) << "it hides something";
  EXPECT_GT(counts[0], 500U) << "and not everything";
  EXPECT_NEAR(static_cast<double>(counts[1]), static_cast<double>(counts[0]), 10);
}

TEST(MeshShape, IsDrawnWhereABoxOfItsShapeIs) {
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  std::vector<std::vector<std::uint8_t>> masks;
  for (const Shape& drawn : {shape(ShapeKind::box, {0.4, 0.7, 1}), test::box_mesh_shape({0.4, 0.7, 1})}) {
    World world;
    world.add("box", {drawn}, Transform<Map, Body>::planar(3, 0.3, 0.6, 0.5));
    RenderJob job = robot_job(jpeg_image(), 3);
    job.world = world.snapshot;
    const auto pixels = (*compositor)->compose_pixels(job);
    ASSERT_TRUE(pixels.ok()) << pixels.error().message;
    masks.push_back(pixels->mask);
  }
  std::size_t drawn = 0, apart = 0;
  for (std::size_t i = 0; i < masks[0].size(); ++i) {
    drawn += masks[0][i] == 255;
    apart += masks[0][i] != masks[1][i];
  }
  EXPECT_GT(drawn, 5000U);
  EXPECT_LT(apart, drawn / 30) << "a box has chamfers, its mesh has not";
}

TEST(Occlusion, DeletedEntitiesAndFreeDoorSpaceHideNothing) {
  SemanticModel model;
  model.entities = {wall("ghost", 1.5, 0, M_PI / 2, 4), wall("opening", 1.6, 0, M_PI / 2, 4)};
  model.entities[0].deleted = true;
  model.entities[1].label = EntityLabel::free_space;
  auto compositor = Compositor::create(model), bare = Compositor::create({});
  ASSERT_TRUE(compositor.ok() && bare.ok());
  const RenderJob job = robot_job(jpeg_image(), 3);
  EXPECT_EQ(visible_pixels(**compositor, job), visible_pixels(**bare, job));
}

TEST(Occlusion, AMovedDoorHidesAtItsCurrentPosition) {
  SemanticModel model;
  model.entities = {wall("door 1", 2, 0, M_PI / 2, 2, 2.1, EntityLabel::door)};
  auto compositor = Compositor::create(model);
  ASSERT_TRUE(compositor.ok());
  EXPECT_EQ(visible_pixels(**compositor, robot_job(jpeg_image(), 3)), 0U);
  World world;
  world.add("red", robot_shapes(), Transform<Map, Body>::planar(3, 0, 0.6));
  world.add("door 1", {shape(ShapeKind::box, {2, 0.12, 2.1})}, Transform<Map, Body>::planar(2, 2.5, 0, 1.05),
            BodyOwner::building, false);
  RenderJob job = robot_job(jpeg_image(), 3);
  job.world = world.snapshot;
  EXPECT_GT(visible_pixels(**compositor, job), 3000U);
}

TEST(StandIn, DescribesItselfAndLeavesInjectedBodiesToTheCompositor) {
  SemanticModel model;
  model.entities = {wall("left", 4, 2, 0, 12), wall("right", 4, -2, 0, 12), wall("end", 9, 0, M_PI / 2, 4)};
  auto camera = VirtualCamera::create(model);
  ASSERT_TRUE(camera.ok()) << camera.error().message;
  const RenderJob job = robot_job(jpeg_image());
  const SensorTime stamp = SensorTime::from_utime(42);
  const Image with = (*camera)->render(job.camera, job.T_map_optical, job.world, stamp, "model of a test");
  const Image without = (*camera)->render(job.camera, job.T_map_optical, {}, stamp, "model of a test");
  const Image agent = (*camera)->render(job.camera, job.T_map_optical, job.world, stamp, "");
  ASSERT_NE(with.find_metadata("stand-in"), nullptr);
  EXPECT_EQ(with.stamp, stamp);
  EXPECT_EQ(with.width, 640);
  EXPECT_EQ(with.bytes, without.bytes);
  EXPECT_EQ(agent.find_metadata("stand-in"), nullptr);
  EXPECT_NE(agent.bytes, without.bytes);
  CameraDescription uncalibrated;
  EXPECT_TRUE((*camera)->render(uncalibrated, job.T_map_optical, {}, stamp, "x").bytes.empty());
}

TEST(SimulatedCamera, ShowsItsOwnRobotAndHasNoise) {
  SemanticModel model;
  model.entities = {wall("left", 4, 2, 0, 12), wall("right", 4, -2, 0, 12), wall("end", 9, 0, M_PI / 2, 4)};
  auto camera = VirtualCamera::create(model);
  ASSERT_TRUE(camera.ok()) << camera.error().message;
  RenderJob job = robot_job(jpeg_image());
  World world;  // a robot with the camera above its deck
  Eigen::Vector3d below = job.T_map_optical * Eigen::Vector3d(0, 0.2, 0.25);
  world.add("own", {shape(ShapeKind::box, {0.6, 0.4, 0.05})},
            Transform<Map, Body>::planar(below.x(), below.y(), 0, below.z()), BodyOwner::real_robot, false);
  const auto picture = [&](const WorldSnapshot& seen, const Exposure& exposure) {
    return (*camera)->render(job.camera, job.T_map_optical, seen, SensorTime{}, "", exposure).bytes;
  };
  const auto nobody = picture({}, {});
  EXPECT_EQ(picture(world.snapshot, {}), nobody);
  EXPECT_NE(picture(world.snapshot, {true, 0, 1, 1}), nobody);
  EXPECT_EQ(picture({}, {true, 0, 1, 1}), nobody);
  EXPECT_EQ(picture({}, {true, 2, 1, 1}), picture({}, {true, 2, 1, 1}));
  EXPECT_NE(picture({}, {true, 2, 1, 1}), picture({}, {true, 2, 1, 2}));
}

TEST(CompositorRepeatability, TheSameJobGivesTheSameBytesFromEveryCompositor) {
  for (const bool distorted : {false, true}) {
    RenderJob job = depth_job(4);
    if (distorted) job.camera.intrinsics.distortion = {-0.3, 0.1, 0, 0, 0};
    auto first = Compositor::create({}), second = Compositor::create({});
    ASSERT_TRUE(first.ok() && second.ok());
    const RenderAnswer a = (*first)->compose(job);
    (*second)->compose(robot_job(raw_image(PixelFormat::rgb, 320, 240), 2));  // another history
    const RenderAnswer b = (*second)->compose(job), c = (*second)->compose(job);
    EXPECT_TRUE(a.drawn);
    EXPECT_EQ(a.image.bytes, b.image.bytes);
    EXPECT_EQ(b.image.bytes, c.image.bytes);
    EXPECT_EQ(a.depth->bytes, b.depth->bytes);
  }
}

TEST(RawFormats, PaddingAndUncoveredPixelsKeepTheirBytes) {
  auto compositor = Compositor::create({});
  ASSERT_TRUE(compositor.ok());
  for (const PixelFormat format : {PixelFormat::gray, PixelFormat::rgb, PixelFormat::bgr}) {
    const RenderJob job = robot_job(raw_image(format, 640, 480, 5));
    const RenderAnswer answer = (*compositor)->compose(job);
    const auto pixels = (*compositor)->compose_pixels(job);
    ASSERT_TRUE(answer.drawn && pixels.ok());
    ASSERT_EQ(answer.image.bytes.size(), job.image.bytes.size());
    const std::size_t channels = format == PixelFormat::gray ? 1 : 3, stride = 640 * channels + 5;
    std::size_t changed = 0;
    for (std::size_t i = 0; i < answer.image.bytes.size(); ++i) {
      const std::size_t x = i % stride / channels, y = i / stride;
      if (x >= 640 || !pixels->mask[640 * y + x]) {
        ASSERT_EQ(answer.image.bytes[i], job.image.bytes[i]);
      } else {
        changed += answer.image.bytes[i] != job.image.bytes[i];
      }
    }
    EXPECT_GT(changed, 1000U);
  }
}

}  // namespace
}  // namespace parhelion::render
