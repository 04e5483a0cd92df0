// Leaves of known angles, seen by a laser: the correct angle is found, or none.
#include "fusion/scan/leaf_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fusion/scan/augment.hpp"
#include "fusion/scan/lidar_model.hpp"

namespace parhelion::scan {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

ModelEntity box(EntityLabel label, double x, double y, double yaw, const Eigen::Vector3d& size) {
  ModelEntity entity;
  entity.label = label;
  entity.T_map_body = Transform<Map, Body>::planar(x, y, yaw, size.z() / 2);
  entity.size = size;
  return entity;
}

/// A room of 8 m by 6 m; the wall at x = 4 has an opening of 0.9 m about y = 0 into another room. Its door
/// hangs at y = -0.45 and opens into the first room.
struct Site {
  LaserDescription laser;
  ModelEntity door = box(EntityLabel::door, 4, 0, std::numbers::pi / 2, {0.9, 0.04, 2});
  SemanticModel walls;
  Transform<Map, Laser> T_map_laser = Transform<Map, Laser>::planar(1.5, 0.8, 0, 0.4);
  std::vector<float> time;
  LeafFit fit;

  Site() {
    laser.convention = {0.1F, 30, RangeConvention::Sentinel::infinity, 0, RangeConvention::Sentinel::value,
                        0};
    laser.noise_sigma = 0.01;
    laser.beams = 1081;
    laser.angle_min = -135 * kDegree;
    laser.angle_increment = 0.25 * kDegree;
    door.hinge = Hinge{{-0.45, 0}, 0, 90 * kDegree, 0};
    const auto wall = [this](double x, double y, double length, double yaw) {
      walls.entities.push_back(box(EntityLabel::wall, x, y, yaw, {length, 0.1, 2.5}));
    };
    wall(4, 1.725, 2.55, 90 * kDegree);
    wall(4, -1.725, 2.55, 90 * kDegree);
    wall(-4, 0, 6, 90 * kDegree);
    wall(8, 0, 6, 90 * kDegree);
    wall(2, 3, 12, 0);
    wall(2, -3, 12, 0);
  }

  /// With the leaf at an angle (none: removed), and people as cylinders (x, y, radius).
  Scan scan(std::optional<double> angle, const std::vector<Eigen::Vector3d>& people = {},
            std::uint64_t sequence = 1) {
    SemanticModel model = walls;
    if (angle) {
      ModelEntity leaf = door;
      leaf.label = EntityLabel::wall;
      leaf.T_map_body = leaf_at(door, *door.hinge, *angle);
      model.entities.push_back(leaf);
    }
    const auto beams = static_cast<std::size_t>(laser.beams);
    beam_times(laser, beams, time);
    const BeamSet set{static_cast<float>(laser.angle_min), static_cast<float>(laser.angle_increment), time};
    std::vector<RangeHit> hits(beams), building(beams);
    cast_building_exact({T_map_laser, T_map_laser}, set, model, 30, building);
    std::vector<BodyDefinition> bodies(people.size());
    std::vector<BodyMotion> motions;
    for (std::size_t i = 0; i < people.size(); ++i) {
      bodies[i].shapes.push_back({ShapeKind::cylinder, {people[i].z(), people[i].z(), 1.8}, {}, {}});
      const auto at = Transform<Map, Body>::planar(people[i].x(), people[i].y(), 0, 0.9);
      motions.push_back({&bodies[i], at, at});
    }
    cast_bodies_exact({T_map_laser, T_map_laser}, set, motions, 30, hits);
    Scan scan;
    simulate_scan(laser, {5, sequence}, hits, building, {}, scan);
    return scan;
  }

  /// `error`: error of the pose that is passed to the fit.
  LeafFitResult find(const Scan& scan, std::optional<double> known = {}, double sigma = 0.02,
                     const Eigen::Vector3d& error = Eigen::Vector3d::Zero()) {
    const auto wrong = T_map_laser.moved_by(error);
    fit.set_scan(scan, laser, {wrong, wrong}, time, sigma);
    return fit.find(door, *door.hinge, known);
  }
};

TEST(LeafFit, FindsEachAngleWithinTwoDegreesFromBothSides) {
  for (const auto& [x, y, yaw] :
       {std::tuple(1.5, 0.8, 0.0), {2.5, -1.2, 0.3}, {0.0, 0.0, 0.1}, {6.0, 1.0, 3.0}}) {
    Site site;
    site.T_map_laser = Transform<Map, Laser>::planar(x, y, yaw, 0.4);
    int found = 0;
    double worst = 0;
    for (int degrees = 0; degrees <= 90; degrees += 3) {
      const LeafFitResult sight = site.find(site.scan(degrees * kDegree));
      if (!sight.angle) continue;
      ++found;
      worst = std::max(worst, std::abs(*sight.angle - degrees * kDegree));
    }
    EXPECT_LT(worst, 2 * kDegree) << x << ", " << y;
    // Seen along its edge, or from behind the wall, the angle is unknown; these are the minority.
    EXPECT_GE(found, x > 4 ? 12 : 24) << x << ", " << y;
  }
}

TEST(LeafFit, APoseErrorOfCentimetresShiftsItByFewDegrees) {
  Site site;
  for (const double degrees : {0.0, 20.0, 45.0, 75.0}) {
    const LeafFitResult sight = site.find(site.scan(degrees * kDegree), {}, 0.03, {0.02, -0.02, 0});
    ASSERT_TRUE(sight.angle) << degrees;
    EXPECT_NEAR(*sight.angle, degrees * kDegree, 4 * kDegree) << degrees;
  }
}

/// An office's partition wall begins next to the hinge: it is flat, upright and long enough.
TEST(LeafFit, IgnoresAWallBesideTheDoor) {
  Site site;
  site.door.hinge->upper = 110 * kDegree;
  site.walls.entities.push_back(box(EntityLabel::wall, 2.8, -0.55, std::numbers::pi, {2.2, 0.1, 2.5}));
  site.walls.entities.push_back(site.door);  // not one of the walls
  const auto walls = walls_beside(site.door, *site.door.hinge, site.walls);
  site.walls.entities.pop_back();
  EXPECT_EQ(walls.size(), 3U) << "the wall that it hangs in, both sides, and this one";
  const auto find = [&](std::optional<double> angle, std::span<const WallBeside> beside) {
    const Scan scan = site.scan(angle);
    site.fit.set_scan(scan, site.laser, {site.T_map_laser, site.T_map_laser}, site.time, 0.03);
    return site.fit.find(site.door, *site.door.hinge, {}, beside);
  };
  ASSERT_TRUE(find({}, {}).angle) << "it was taken for one";
  EXPECT_FALSE(find({}, walls).angle);
  for (const double degrees : {0.0, 20.0, 40.0}) {
    const LeafFitResult sight = find(degrees * kDegree, walls);
    ASSERT_TRUE(sight.angle) << degrees;
    EXPECT_NEAR(*sight.angle, degrees * kDegree, 3 * kDegree);
  }
}

TEST(LeafFit, AModelledWallAcrossTheOpeningHidesNoDoor) {
  Site site;
  SemanticModel across;
  across.entities.push_back(box(EntityLabel::wall, 4, 0, std::numbers::pi / 2, {6, 0.1, 2.5}));
  EXPECT_TRUE(walls_beside(site.door, *site.door.hinge, across).empty());
}

TEST(LeafFit, ReportsNothingForAMissingLeaf) {
  Site site;
  const LeafFitResult sight = site.find(site.scan(std::nullopt), 0.0);
  EXPECT_FALSE(sight.angle);
  EXPECT_TRUE(sight.gone) << "beams pass where it was closed";
}

TEST(LeafFit, IgnoresAPersonInTheDoorway) {
  Site site;
  for (double y = -0.35; y <= 0.36; y += 0.05) {
    for (const double x : {3.7, 3.9, 4.1}) {
      EXPECT_FALSE(site.find(site.scan(std::nullopt, {{x, y, 0.18}})).angle) << x << ", " << y;
      EXPECT_FALSE(site.find(site.scan(std::nullopt, {{x, y, 0.06}, {x, y + 0.2, 0.06}})).angle)
          << x << ", " << y;
    }
  }
}

TEST(LeafFit, FindsTheLeafBehindAPersonOrReportsNothing) {
  Site site;
  int found = 0;
  for (int degrees = 0; degrees <= 90; degrees += 10) {
    for (const double y : {-0.3, 0.0, 0.3}) {
      const LeafFitResult sight = site.find(site.scan(degrees * kDegree, {{3.2, y + 0.3, 0.2}}));
      if (!sight.angle) continue;
      ++found;
      EXPECT_NEAR(*sight.angle, degrees * kDegree, 2 * kDegree) << y;
    }
  }
  EXPECT_GE(found, 15);
}

TEST(LeafFit, ReportsNeitherAngleNorAbsenceWithoutBeamsOnTheLeaf) {
  Site site;
  site.T_map_laser = Transform<Map, Laser>::planar(1.5, 0.8, std::numbers::pi, 0.4);
  LeafFitResult sight = site.find(site.scan(0.3), 0.3);
  EXPECT_FALSE(sight.angle);
  EXPECT_FALSE(sight.gone);
  site = Site();
  // A person in front of the laser.
  sight = site.find(site.scan(0.3, {{1.9, 0.75, 0.3}}), 0.3);
  EXPECT_FALSE(sight.angle);
  EXPECT_FALSE(sight.gone);
  // Over the leaf.
  site = Site();
  site.T_map_laser = Transform<Map, Laser>::planar(1.5, 0.8, 0, 2.2);
  EXPECT_FALSE(site.find(site.scan(0.3), 0.3).angle);
}

TEST(LeafFit, TheSameScanGivesTheSameBits) {
  Site site;
  const Scan scan = site.scan(0.5);
  const LeafFitResult first = site.find(scan);
  site.find(site.scan(1.2));
  const LeafFitResult again = site.find(scan);
  ASSERT_TRUE(first.angle && again.angle);
  EXPECT_EQ(*first.angle, *again.angle);
  EXPECT_EQ(first.returns, again.returns);
}

}  // namespace
}  // namespace parhelion::scan
