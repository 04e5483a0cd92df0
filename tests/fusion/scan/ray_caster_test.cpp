// The caster and its reference against hand-computed results.
#include "fusion/scan/ray_caster.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/fusion/scan/hits_agree.hpp"

namespace parhelion::scan {
namespace {

constexpr float kNone = std::numeric_limits<float>::infinity();

/// One body of one shape, cast by both casters, which must agree.
struct Single {
  BodyDefinition definition;
  BodyMotion motion;
  LaserMotion laser;
  std::vector<float> time;
  BeamSet beams;
  double max_range = 80;

  explicit Single(const Shape& shape) { definition.shapes.push_back(shape); }

  /// Beams with the same bearing `angle` (no step), spread over the sweep.
  void look_along(double angle, std::size_t n) {
    time.resize(n);
    for (std::size_t i = 0; i < n; ++i) time[i] = static_cast<float>(i) / static_cast<float>(n - 1);
    beams = {static_cast<float>(angle), 0, time};
  }
  void look_around(double first, double step, std::size_t n) {
    time.assign(n, 0);
    beams = {static_cast<float>(first), static_cast<float>(step), time};
  }
  std::vector<RangeHit> cast() {
    motion.body = &definition;
    std::vector<RangeHit> fast(time.size()), reference(time.size());
    RayCaster caster;
    caster.cast_bodies(laser, beams, std::span(&motion, 1), max_range, fast);
    cast_bodies_exact(laser, beams, std::span(&motion, 1), max_range, reference);
    for (std::size_t i = 0; i < fast.size(); ++i)
      EXPECT_TRUE(test::hits_agree(fast[i], reference[i])) << "beam " << i;
    return fast;
  }
  void stand(const Transform<Map, Body>& T_map_body) {
    motion.T_map_body_start = T_map_body;
    motion.T_map_body_end = T_map_body;
  }
};

Shape shape_of(ShapeKind kind, const Eigen::Vector3d& size) {
  Shape shape;
  shape.kind = kind;
  shape.size = size;
  return shape;
}

using PlanarBody = Transform<Map, Body>;
using PlanarLaser = Transform<Map, Laser>;

TEST(RayCaster, hits_a_moving_body_at_its_pose_at_each_beam_time) {
  Single scene(shape_of(ShapeKind::sphere, {0.5, 0.5, 0.5}));
  scene.motion.T_map_body_start = PlanarBody::planar(5, -2, 0);
  scene.motion.T_map_body_end = PlanarBody::planar(5, 2, 0);
  scene.look_along(0, 401);
  const auto hits = scene.cast();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const double y = -2 + 4 * double{scene.time[i]};
    if (std::abs(std::abs(y) - 0.5) < 1e-6) continue;
    if (std::abs(y) < 0.5) {
      EXPECT_NEAR(hits[i].range, 5 - std::sqrt(0.25 - y * y), 1e-5);
      EXPECT_EQ(hits[i].body, 0);
    } else {
      EXPECT_EQ(hits[i].range, kNone);
      EXPECT_EQ(hits[i].body, -1);
    }
  }
}

TEST(RayCaster, uses_the_laser_pose_at_each_beam_time) {
  Single scene(shape_of(ShapeKind::box, {2, 100, 2}));
  scene.stand(PlanarBody::planar(6, 0, 0));
  scene.laser.T_map_laser_start = PlanarLaser::planar(0, 0, 0);
  scene.laser.T_map_laser_end = PlanarLaser::planar(1, 0.5, 0.8);
  scene.look_along(0, 101);
  const auto hits = scene.cast();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const double s = scene.time[i];
    EXPECT_NEAR(hits[i].range, (5 - s) / std::cos(0.8 * s), 1e-5);
  }
}

TEST(RayCaster, follows_a_body_that_turns_during_the_sweep) {
  // A plank that turns by a quarter: broadside first, end-on last.
  Single scene(shape_of(ShapeKind::box, {0.2, 4, 1}));
  scene.motion.T_map_body_start = PlanarBody::planar(5, 0, 0);
  scene.motion.T_map_body_end = PlanarBody::planar(5, 0, std::numbers::pi / 2);
  scene.look_along(0, 3);
  const auto hits = scene.cast();
  EXPECT_NEAR(hits[0].range, 4.9, 1e-5);
  EXPECT_NEAR(hits[1].range, 5 - 0.1 * std::sqrt(2.0), 1e-5);
  EXPECT_NEAR(hits[2].range, 3, 1e-5);
}

TEST(RayCaster, returns_zero_where_the_laser_is_inside_a_body) {
  for (const ShapeKind kind : {ShapeKind::box, ShapeKind::cylinder, ShapeKind::sphere, ShapeKind::capsule}) {
    Single scene(shape_of(kind, {1, 1, 1}));
    scene.stand(PlanarBody::planar(0.2, 0.1, 0.3, 0.1));
    scene.look_around(-3, 0.01, 600);
    for (const RangeHit& hit : scene.cast()) {
      EXPECT_EQ(hit.range, 0);
      EXPECT_EQ(hit.body, 0);
    }
  }
}

TEST(RayCaster, sees_the_same_clockwise_and_counter_clockwise) {
  Single scene(shape_of(ShapeKind::box, {1, 1, 1}));
  scene.stand(PlanarBody::planar(3, 1, 0.4));
  scene.look_around(-1.5, 0.01, 301);
  const auto left = scene.cast();
  scene.look_around(1.5, -0.01, 301);
  const auto right = scene.cast();
  std::size_t hits = 0;
  for (std::size_t i = 0; i < left.size(); ++i) {
    if (std::isinf(left[i].range) != std::isinf(right[300 - i].range))
      continue;  // angles differ in the last bit
    if (std::isfinite(left[i].range)) {
      EXPECT_NEAR(left[i].range, right[300 - i].range, 1e-4);
    }
    hits += std::isfinite(left[i].range);
  }
  EXPECT_GT(hits, 30U);
}

TEST(RayCaster, sees_a_body_behind_it_at_both_ends_of_a_full_turn) {
  Single scene(shape_of(ShapeKind::sphere, {0.5, 0.5, 0.5}));
  scene.stand(PlanarBody::planar(-5, 0, 0));
  scene.look_around(-std::numbers::pi, 2 * std::numbers::pi / 720, 720);
  const auto hits = scene.cast();
  EXPECT_NEAR(hits.front().range, 4.5, 1e-5);
  EXPECT_NEAR(hits.back().range, 4.5, 1e-2);
  EXPECT_EQ(hits[360].range, kNone);
  // One and a half turns: seen in the middle and at the end, and once more in the second turn.
  scene.look_around(0, 3 * std::numbers::pi / 1080, 1080);
  const auto twice = scene.cast();
  EXPECT_NEAR(twice[360].range, 4.5, 1e-5);
  EXPECT_NEAR(twice[1079].range, 4.5, 1e-2);
  EXPECT_EQ(twice[720].range, kNone);
}

TEST(RayCaster, sees_bodies_above_its_plane_only_when_it_looks_up) {
  Single scene(shape_of(ShapeKind::box, {1, 1, 1}));
  scene.stand(PlanarBody::planar(5, 0, 0, 1));
  scene.look_around(-0.5, 0.01, 101);
  for (const RangeHit& hit : scene.cast()) EXPECT_EQ(hit.range, kNone);
  const Eigen::Quaterniond up(Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()));
  scene.laser.T_map_laser_start = {up, Eigen::Vector3d::Zero()};
  scene.laser.T_map_laser_end = scene.laser.T_map_laser_start;
  EXPECT_NEAR(scene.cast()[50].range, 4.5 / std::cos(0.2), 1e-5);
  // A laser that nods during the sweep looks up only at its end.
  scene.laser.T_map_laser_start = {};
  scene.look_along(0, 11);
  const auto nodding = scene.cast();
  EXPECT_EQ(nodding.front().range, kNone);
  EXPECT_NEAR(nodding.back().range, 4.5 / std::cos(0.2), 1e-5);
}

TEST(RayCaster, has_no_hits_out_of_range_without_bodies_or_without_pose) {
  Single scene(shape_of(ShapeKind::sphere, {0.5, 0.5, 0.5}));
  scene.stand(PlanarBody::planar(5, 0, 0));
  scene.look_along(0, 2);
  scene.max_range = 4.49;
  EXPECT_EQ(scene.cast()[0].range, kNone);
  scene.max_range = 4.51;
  EXPECT_NEAR(scene.cast()[0].range, 4.5, 1e-5);

  RayCaster caster;
  std::vector<RangeHit> hits(2);
  caster.cast_bodies(scene.laser, scene.beams, {}, 80, hits);
  EXPECT_EQ(hits[0].range, kNone);
  caster.cast_building(scene.laser, scene.beams, 80, hits);
  EXPECT_EQ(hits[0].range, kNone) << "no building was set";

  const double nan = std::nan("");
  const PlanarBody nowhere(Eigen::Isometry3d(Eigen::Translation3d(nan, 0, 0)));
  const BodyMotion lost{&scene.definition, nowhere, nowhere};
  caster.cast_bodies(scene.laser, scene.beams, std::span(&lost, 1), 80, hits);
  EXPECT_EQ(hits[0].range, kNone);
  const PlanarLaser blind(Eigen::Isometry3d(Eigen::Translation3d(nan, 0, 0)));
  caster.cast_bodies({blind, blind}, scene.beams, std::span(&scene.motion, 1), 80, hits);
  EXPECT_EQ(hits[0].range, kNone);
  EXPECT_EQ(hits[0].body, -1);
}

TEST(RayCaster, reports_the_first_of_two_coincident_bodies) {
  BodyDefinition a, b;
  a.shapes.push_back(shape_of(ShapeKind::box, {1, 1, 1}));
  // The same face, by a larger box whose centre is farther away.
  b.shapes.push_back(shape_of(ShapeKind::box, {3, 1, 1}));
  const PlanarBody near = PlanarBody::planar(5, 0, 0), far = PlanarBody::planar(6, 0, 0);
  const float time[1] = {0};
  RangeHit hit[1];
  RayCaster caster;
  const BodyMotion far_first[] = {{&b, far, far}, {&a, near, near}};
  caster.cast_bodies({}, {0, 0, time}, far_first, 80, hit);
  EXPECT_EQ(hit[0].range, 4.5F);
  EXPECT_EQ(hit[0].body, 0);
  const BodyMotion near_first[] = {{&a, near, near}, {&b, far, far}};
  caster.cast_bodies({}, {0, 0, time}, near_first, 80, hit);
  EXPECT_EQ(hit[0].body, 0);
}

TEST(RayCaster, leaves_virtual_entities_out_of_the_building) {
  SemanticModel model;
  ModelEntity wall;
  wall.T_map_body = PlanarBody::planar(5, 0, 0);
  wall.is_virtual = true;
  model.entities.push_back(wall);
  wall.is_virtual = false;
  wall.T_map_body = PlanarBody::planar(8, 0, 0);
  wall.material.laser_reflectivity = 0.25F;
  model.entities.push_back(wall);
  RayCaster caster;
  caster.set_building(model);
  const float time[1] = {0};
  RangeHit hit[1];
  caster.cast_building({}, {0, 0, time}, 80, hit);
  EXPECT_EQ(hit[0].range, 7.5F);
  EXPECT_EQ(hit[0].reflectivity, 0.25F);
  EXPECT_EQ(hit[0].body, -1) << "the building counts as none";
  caster.set_building(SemanticModel{});
  caster.cast_building({}, {0, 0, time}, 80, hit);
  EXPECT_EQ(hit[0].range, kNone) << "a new model takes the place of the old one";
}

}  // namespace
}  // namespace parhelion::scan
