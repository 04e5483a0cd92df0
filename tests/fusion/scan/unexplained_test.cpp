#include "fusion/scan/unexplained.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "fusion/scan/augment.hpp"

namespace parhelion::scan {
namespace {

constexpr std::size_t kBeams = 361;

/// A square room of 10 m with the laser in its middle unless moved, and real scans of it with additional
/// objects.
struct Room {
  LaserDescription laser;
  SemanticModel model;
  LaserMotion motion;
  std::vector<float> time = std::vector<float>(kBeams, 0);
  float angle_min = static_cast<float>(-std::numbers::pi / 2);
  float angle_increment = static_cast<float>(std::numbers::pi / 360);
  std::vector<RangeHit> building;

  Room() {
    laser.convention = {0.1F, 30, RangeConvention::Sentinel::infinity, 0, RangeConvention::Sentinel::value,
                        0};
    laser.noise_sigma = 0.01;
    for (int side = 0; side < 4; ++side) {
      const double yaw = side * std::numbers::pi / 2;
      ModelEntity wall;
      wall.size = {10, 0.2, 2.5};
      wall.T_map_body = Transform<Map, Body>::planar(5 * std::sin(yaw), 5 * std::cos(yaw), -yaw, 1.25);
      model.entities.push_back(wall);
    }
    place(Transform<Map, Laser>::planar(0, 0, 0, 0.3));
  }
  void place(const Transform<Map, Laser>& T_map_laser) { motion = {T_map_laser, T_map_laser}; }

  /// People are upright cylinders at x, y with a radius.
  Scan scan(const std::vector<Eigen::Vector3d>& people, double wall_offset = 0) {
    const BeamSet beams{angle_min, angle_increment, time};
    building.resize(kBeams);
    cast_building_exact(motion, beams, model, 30, building);
    std::vector<BodyDefinition> bodies(people.size());
    std::vector<BodyMotion> motions;
    for (std::size_t i = 0; i < people.size(); ++i) {
      Shape shape;
      shape.kind = ShapeKind::cylinder;
      shape.size = {people[i].z(), people[i].z(), 1.8};
      bodies[i].shapes.push_back(shape);
      const auto T_map_body = Transform<Map, Body>::planar(people[i].x(), people[i].y(), 0, 0.9);
      motions.push_back({&bodies[i], T_map_body, T_map_body});
    }
    std::vector<RangeHit> hits(kBeams), walls = building;
    cast_bodies_exact(motion, beams, motions, 30, hits);
    for (RangeHit& wall : walls) wall.range -= static_cast<float>(wall_offset);
    Scan scan;
    laser.angle_min = angle_min;
    laser.angle_increment = angle_increment;
    simulate_scan(laser, {5, 1}, hits, walls, {}, scan);
    return scan;
  }

  std::vector<UnexplainedDisc> find(const Scan& scan, double sigma = 0.02) {
    UnexplainedReturns unexplained;
    const auto discs = unexplained.find(scan, laser, motion, time, building, sigma);
    return {discs.begin(), discs.end()};
  }
};

TEST(UnexplainedReturns, do_not_occur_in_an_empty_room) {
  Room room;
  EXPECT_TRUE(room.find(room.scan({})).empty());
}

TEST(UnexplainedReturns, a_person_gives_one_disc_at_its_position) {
  Room room;
  room.place(Transform<Map, Laser>::planar(-1, 0.5, 0.7, 0.3));
  const auto discs = room.find(room.scan({{1.5, 2, 0.25}}));
  ASSERT_EQ(discs.size(), 1U);
  EXPECT_LT((discs[0].center - Eigen::Vector2d(1.5, 2)).norm(), 0.3);
  EXPECT_GE(discs[0].radius, 0.2);
  EXPECT_LE(discs[0].radius, 0.4);
  EXPECT_GT(discs[0].returns, 10U);
}

TEST(UnexplainedReturns, two_people_give_two_discs) {
  Room room;
  const auto discs = room.find(room.scan({{2, 1, 0.2}, {2, -1, 0.2}}));
  ASSERT_EQ(discs.size(), 2U);
  EXPECT_LT((discs[0].center - Eigen::Vector2d(2, -1)).norm(), 0.3);
  EXPECT_LT((discs[1].center - Eigen::Vector2d(2, 1)).norm(), 0.3);
}

TEST(UnexplainedReturns, ignore_walls_off_by_less_than_the_margin) {
  Room room;
  EXPECT_TRUE(room.find(room.scan({}, 0.25)).empty());
  EXPECT_FALSE(room.find(room.scan({}, 0.6)).empty()) << "a wall 0.6 m nearer than modelled is not explained";
  EXPECT_TRUE(room.find(room.scan({}, 0.6), 0.15).empty()) << "it may be, where the pose is uncertain";
}

TEST(UnexplainedReturns, ignore_objects_against_a_wall) {
  Room room;
  EXPECT_TRUE(room.find(room.scan({{4.7, 0, 0.1}})).empty());
}

TEST(UnexplainedReturns, ignore_door_frames_under_a_small_pose_error) {
  // A wall with an opening; the real robot is 5 cm beside its estimated position, so beams past the modelled
  // edge return from the real one.
  Room room;
  ModelEntity wall;
  wall.size = {3, 0.2, 2.5};
  wall.T_map_body = Transform<Map, Body>::planar(2.5, 1.5, std::numbers::pi / 2, 1.25);
  room.model.entities.push_back(wall);
  room.place(Transform<Map, Laser>::planar(0, 0.05, 0, 0.3));
  const Scan real = room.scan({});
  room.place(Transform<Map, Laser>::planar(0, 0, 0, 0.3));
  room.scan({});
  EXPECT_TRUE(room.find(real).empty());
}

TEST(UnexplainedReturns, cut_long_things_into_discs) {
  Room room;
  ModelEntity unmodelled;
  unmodelled.size = {4, 0.2, 2};
  unmodelled.T_map_body = Transform<Map, Body>::planar(2, 0, std::numbers::pi / 2, 1);
  room.model.entities.push_back(unmodelled);
  const Scan real = room.scan({});
  room.model.entities.pop_back();
  room.scan({});
  const auto discs = room.find(real);
  ASSERT_GE(discs.size(), 4U);
  for (const UnexplainedDisc& disc : discs) {
    EXPECT_LE(disc.radius, 0.75);
    EXPECT_NEAR(disc.center.x(), 1.9, 0.1);
  }
}

TEST(UnexplainedReturns, are_not_split_at_the_seam_of_a_full_turn) {
  Room room;
  room.angle_min = static_cast<float>(-std::numbers::pi);
  room.angle_increment = static_cast<float>(2 * std::numbers::pi / kBeams);
  const auto discs = room.find(room.scan({{-2, 0, 0.25}}));
  ASSERT_EQ(discs.size(), 1U) << "a person behind the laser is cut by the ends of the scan";
  EXPECT_LT((discs[0].center - Eigen::Vector2d(-2, 0)).norm(), 0.3);
}

TEST(UnexplainedReturns, ignore_sentinels_and_unknown_beams) {
  Room room;
  Scan scan = room.scan({{2, 0, 0.3}});
  for (float& range : scan.ranges) {
    if (range < 3) range = 0;  // too close, in this sensor's convention
  }
  EXPECT_TRUE(room.find(scan).empty());
  scan = room.scan({{2, 0, 0.3}});
  room.building.clear();
  EXPECT_TRUE(room.find(scan).empty());
}

}  // namespace
}  // namespace parhelion::scan
