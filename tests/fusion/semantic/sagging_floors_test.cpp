// One floor bent by angular errors of the scanner, against two floors with a step between them.
#include "fusion/semantic/net/sagging_floors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace parhelion::semantic {
namespace {

constexpr double kScanner = 0.5;  // m, of the scanner over its floor

struct SaggingSite {
  cloud::PointCloud<Map> cloud;
  SemanticModel model;
};

void add_floor(SaggingSite& site, const char* name, double from, double to, double z) {
  ModelEntity& floor = site.model.entities.emplace_back();
  floor.name = name;
  floor.label = EntityLabel::floor;
  floor.T_map_body = Transform<Map, Body>::planar((from + to) / 2, 0, 0, z - 0.05);
  floor.size = {to - from, 2, 0.1};
}

/// A floor of 5 m and one of 3 m beyond it, lower by `below`, seen with angular errors of up to `off` (rad).
SaggingSite site_of(double below, double off) {
  SaggingSite site;
  site.cloud.viewpoints = {{0, 0, kScanner}};
  std::mt19937_64 random(3);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1.0p-53; };
  for (int i = 0; i < 6000; ++i) {
    const double x = 0.4 + 7.6 * uniform(), y = 2 * uniform() - 1, away = std::hypot(x, y);
    const double z = (x > 5 ? -below : 0) + off * (2 * uniform() - 1) * away;
    site.cloud.points.emplace_back(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    site.cloud.scans.push_back(0);
    site.cloud.labels.push_back(static_cast<std::uint8_t>(EntityLabel::floor));
  }
  add_floor(site, "floor 1", 0, 5, 0);
  add_floor(site, "floor 2", 5.1, 8, -below);
  ModelEntity& wall = site.model.entities.emplace_back();
  wall.name = "wall 1";
  wall.label = EntityLabel::wall;
  wall.T_map_body = Transform<Map, Body>::planar(6, 1, 0, 1);
  wall.size = {3, 0.1, 2};
  site.model.relations = {{RelationKind::under, "floor 2", "wall 1", 0.9}};
  return site;
}

TEST(SaggingFloors, AreMergedWithTheFloorWithinAngleError) {
  SaggingSite site = site_of(0.15, 0.035);
  EXPECT_EQ(join_sagging_floors(site.cloud, site.model), 1U);
  ASSERT_EQ(site.model.entities.size(), 2U);
  const ModelEntity& floor = site.model.entities[0];
  EXPECT_EQ(floor.name, "floor 1");
  EXPECT_NEAR(floor.T_map_body.translation().z() + floor.size.z() / 2, 0, 1e-9)
      << "it stays where it was seen well";
  EXPECT_NEAR(floor.T_map_body.translation().x() - floor.size.x() / 2, 0, 1e-9);
  EXPECT_NEAR(floor.T_map_body.translation().x() + floor.size.x() / 2, 8, 1e-9);
  EXPECT_EQ(site.model.entities[1].name, "wall 1");
  ASSERT_EQ(site.model.relations.size(), 1U);
  EXPECT_EQ(site.model.relations[0].from, "floor 1");
}

TEST(SaggingFloors, StepsDownAreKeptInSharpScans) {
  for (const double below : {0.12, 0.15, 0.17, 0.30}) {
    SaggingSite site = site_of(below, 0.006);
    EXPECT_EQ(join_sagging_floors(site.cloud, site.model), 0U) << below;
    EXPECT_EQ(site.model.entities.size(), 3U);
    EXPECT_EQ(site.model.entities[1].name, "floor 2");
  }
}

TEST(SaggingFloors, NothingIsMergedWithoutScannerPoses) {
  SaggingSite site = site_of(0.15, 0.035);
  site.cloud.viewpoints.clear();
  EXPECT_EQ(join_sagging_floors(site.cloud, site.model), 0U);
  EXPECT_EQ(join_sagging_floors(cloud::PointCloud<Map>{}, site.model), 0U);
}

TEST(SaggingFloors, LockedEntitiesAreKept) {
  SaggingSite site = site_of(0.15, 0.035);
  site.model.entities[1].locked = true;
  EXPECT_EQ(join_sagging_floors(site.cloud, site.model), 0U);
}

}  // namespace
}  // namespace parhelion::semantic
