#include "fusion/semantic/pictures/plan_picture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "fusion/semantic/grid/extrude.hpp"
#include "tests/file_bytes.hpp"
#include "tests/fusion/semantic/rooms.hpp"

namespace parhelion::semantic {
namespace {

using Eigen::Vector2d;
using test::bytes_of;

struct Site {
  pose::GridMap map;
  SemanticModel model;
  WorldSnapshot world;
  PlanPicture picture;
};

BodyState add_body(Scene& scene, const std::string& entity, BodyOwner owner, ShapeKind kind,
                   const Eigen::Vector3d& size, double x, double y, double yaw) {
  auto body = std::make_shared<BodyDefinition>();
  body->id = static_cast<BodyId>(scene.bodies.size() + 1);
  body->entity = entity;
  body->owner = owner;
  body->shapes.push_back({kind, size, {}, {}});
  scene.bodies.push_back(body);
  return {body->id, 0, Transform<Map, Body>::planar(x, y, yaw, 0.3), {}, {}};
}

void add_world(Site& site) {
  auto scene = std::make_shared<Scene>();
  auto& bodies = site.world.bodies;
  bodies.push_back(
      add_body(*scene, "robot", BodyOwner::real_robot, ShapeKind::box, {0.7, 0.5, 0.4}, 4, 2.2, 0.3));
  bodies.push_back(add_body(*scene, "crate", BodyOwner::agent, ShapeKind::box, {0.6, 0.4, 0.6}, 7, 3, 0.7));
  bodies.push_back(
      add_body(*scene, "barrel_1", BodyOwner::agent, ShapeKind::cylinder, {0.3, 0.3, 0.9}, 8, 1.5, 0));
  bodies.push_back(
      add_body(*scene, "visitor", BodyOwner::agent, ShapeKind::capsule, {0.2, 0.2, 1.2}, 9.3, 3.2, 0));
  site.world.scene = scene;
}

/// A corridor and a room, scanned; a robot that drove through, three agents, one scan with virtual returns.
Site make_site() {
  Site site;
  const std::vector<test::Wall> walls{{{0, 0}, {14, 0}},  {{14, 0}, {14, 7}}, {{14, 7}, {0, 7}},
                                      {{0, 7}, {0, 0}},   {{0, 4}, {5, 4}},   {{6, 4}, {10, 4}},
                                      {{11, 4}, {14, 4}}, {{7, 4}, {7, 7}}};
  std::vector<Vector2d> places;
  for (int i = 0; i < 12; ++i) places.emplace_back(1 + i, 2 + 0.4 * (i % 3));
  places.insert(places.end(), {{3, 5.5}, {10, 5.5}});
  site.map = test::scanned_map(walls, places, 16, 10, 0.015, 3);
  site.model = *extrude(site.map, {});
  add_world(site);
  PlanPath path{"path of the robot", {31, 111, 235}, {}};
  for (int i = 0; i <= 60; ++i) path.points.emplace_back(1 + 0.05 * i, 1.6 + 0.6 * std::sin(i * 0.05));
  Scan scan;
  LaserDescription laser;
  laser.convention.range_max = 20;
  scan.angle_min = -1.57F;
  scan.angle_increment = 3.14F / 360;
  std::vector<std::int16_t> agents(361, -1);
  const auto T_map_base = Transform<Map, Base>::planar(4, 2.2, 0.3);
  for (int i = 0; i <= 360; ++i) {
    const double angle = 0.3 + scan.angle_min + i * static_cast<double>(scan.angle_increment);
    double range = test::cast({4, 2.2}, angle, walls, 30);
    const double to_barrel = test::cast({4, 2.2}, angle, {{{7.8, 1.2}, {7.8, 1.8}}}, 30);
    if (to_barrel < range) {
      range = to_barrel;
      agents[static_cast<std::size_t>(i)] = 0;
    }
    scan.ranges.push_back(static_cast<float>(range));
  }
  site.picture.scan = plan_scan(scan, laser, agents, T_map_base);
  site.picture.title = "Corridor with three virtual agents";
  site.picture.subtitle = "synthetic grid of 5 cm; one augmented scan";
  site.picture.paths.push_back(path);
  return site;
}

std::string out_path(const std::string& name) { return ::testing::TempDir() + "parhelion_" + name; }

TEST(PlanPicture, DrawsASiteDeterministically) {
  Site site = make_site();
  site.picture.map = &site.map;
  site.picture.model = &site.model;
  site.picture.world = &site.world;
  const std::string path = out_path("plan.png");
  const Status first = draw_plan(site.picture, path);
  ASSERT_TRUE(first) << first.error().message;
  const std::string bytes = bytes_of(path);
  EXPECT_EQ(bytes.substr(1, 3), "PNG");
  ASSERT_TRUE(draw_plan(site.picture, path));
  EXPECT_EQ(bytes_of(path), bytes);
  site.picture.world = nullptr;
  const std::string without = out_path("plan_without_agents.png");
  ASSERT_TRUE(draw_plan(site.picture, without));
  EXPECT_NE(bytes_of(without), bytes) << "the agents were not drawn";
}

TEST(PlanPicture, FocusOmitsDistantEntities) {
  const Site site = make_site();
  PlanPicture picture = site.picture;
  const std::string near = out_path("near.png"), nearer = out_path("nearer.png");
  picture.map = &site.map;
  picture.focus = 2;
  ASSERT_TRUE(draw_plan(picture, near));
  pose::GridMap far = site.map;  // one more occupied cell, far from the robot
  *test::cell_at(far, {14.9, 7.9}) = 1;
  picture.map = &far;
  ASSERT_TRUE(draw_plan(picture, nearer));
  EXPECT_EQ(bytes_of(near), bytes_of(nearer));
  picture.paths.clear();
  picture.scan.reset();
  EXPECT_THAT(draw_plan(picture, near).error().message, ::testing::HasSubstr("nothing to draw"));
}

TEST(PlanPicture, EachPartMayBeAbsent) {
  const Site site = make_site();
  PlanPicture picture;
  picture.map = &site.map;
  EXPECT_TRUE(draw_plan(picture, out_path("map.png")));
  picture = {};
  picture.model = &site.model;
  EXPECT_TRUE(draw_plan(picture, out_path("model.png")));
  picture = {};
  picture.scan = site.picture.scan;
  EXPECT_TRUE(draw_plan(picture, out_path("scan.png")));
  picture = {};
  picture.paths = site.picture.paths;
  EXPECT_TRUE(draw_plan(picture, out_path("path.png")));
}

TEST(PlanPicture, RefusesEmptyInputAndInvalidPaths) {
  PlanPicture picture;
  EXPECT_THAT(draw_plan(picture, "x.png").error().message, ::testing::HasSubstr("nothing to draw"));
  picture.paths.push_back({"", {}, {{0, 0}, {1, 1}}});
  EXPECT_THAT(draw_plan(picture, "/nowhere/at/all/x.png").error().message,
              ::testing::HasSubstr("cannot be written"));
  EXPECT_FALSE(draw_plan(picture, out_path("no_extension")));
  picture.width = 0;
  EXPECT_THAT(draw_plan(picture, "x.png").error().message, ::testing::HasSubstr("400 <= width"));
  picture.width = 800;
  picture.paths[0].points.push_back({std::numeric_limits<double>::infinity(), 0});
  EXPECT_FALSE(draw_plan(picture, out_path("infinite.png")));
}

TEST(PlanPicture, ScanIsPlacedByTheLasersPose) {
  Scan scan;
  scan.ranges = {2, std::numeric_limits<float>::infinity(), 3};
  scan.angle_increment = static_cast<float>(std::numbers::pi / 4);
  LaserDescription laser;
  laser.convention.range_max = 10;
  laser.T_base_laser = Transform<Base, Laser>::planar(1, 0, 0);
  const std::int16_t agents[] = {-1, -1, 4};
  const auto plan = plan_scan(scan, laser, agents, Transform<Map, Base>::planar(5, 6, std::numbers::pi / 2));
  EXPECT_TRUE(plan.laser.isApprox(Vector2d(5, 7), 1e-12));
  ASSERT_EQ(plan.real.size(), 1U);
  ASSERT_EQ(plan.injected.size(), 1U);
  EXPECT_TRUE(plan.real[0].isApprox(Vector2d(5, 9), 1e-6));
  EXPECT_TRUE(plan.injected[0].isApprox(Vector2d(2, 7), 1e-6));
}

}  // namespace
}  // namespace parhelion::semantic
