// Objects: what is no part of the building, as instances of a kind.
#include "fusion/semantic/objects/find_objects.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/model_box.hpp"

namespace parhelion::semantic {
namespace {

/// Points 2 cm apart on the faces of a box, but the lower one.
void add_box(cloud::PointCloud<Map>& cloud, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  const auto add = [&](double x, double y, double z) {
    cloud.points.emplace_back(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    cloud.labels.push_back(static_cast<std::uint8_t>(EntityLabel::unknown));
  };
  constexpr double kStep = 0.02;
  for (double x = low.x(); x <= high.x() + 1e-9; x += kStep) {
    for (double y = low.y(); y <= high.y() + 1e-9; y += kStep) add(x, y, high.z());
    for (double z = low.z(); z <= high.z(); z += kStep) add(x, low.y(), z), add(x, high.y(), z);
  }
  for (double y = low.y(); y <= high.y() + 1e-9; y += kStep) {
    for (double z = low.z(); z <= high.z(); z += kStep) add(low.x(), y, z), add(high.x(), y, z);
  }
}

void add_table(cloud::PointCloud<Map>& cloud, double x, double y) {
  add_box(cloud, {x - 0.7, y - 0.4, 0.70}, {x + 0.7, y + 0.4, 0.73});
  for (const double dx : {-0.66, 0.62}) {
    for (const double dy : {-0.36, 0.32})
      add_box(cloud, {x + dx, y + dy, 0}, {x + dx + 0.04, y + dy + 0.04, 0.7});
  }
}

void add_chair(cloud::PointCloud<Map>& cloud, double x, double y) {
  add_box(cloud, {x - 0.22, y - 0.22, 0.42}, {x + 0.22, y + 0.22, 0.46});
  add_box(cloud, {x - 0.22, y + 0.18, 0.46}, {x + 0.22, y + 0.22, 0.9});
  for (const double dx : {-0.2, 0.16}) {
    for (const double dy : {-0.2, 0.16})
      add_box(cloud, {x + dx, y + dy, 0}, {x + dx + 0.04, y + dy + 0.04, 0.42});
  }
}

/// Not as wide as a street.
std::vector<ModelEntity> floor_of() {
  return {test::model_box("floor 1", EntityLabel::floor, {0, 0, -0.05}, {10, 10, 0.1})};
}

FoundObjects found_in(const cloud::PointCloud<Map>& cloud) {
  return find_objects(cloud, cloud.labels, floor_of());
}

long count_kind(const FoundObjects& found, ObjectKind kind) {
  return std::count_if(found.objects.begin(), found.objects.end(),
                       [&](const ModelObject& o) { return o.kind == kind; });
}

TEST(FindObjects, ATableAndItsChairsAreThingsOfTheirOwn) {
  cloud::PointCloud<Map> cloud;
  add_table(cloud, 0, 0);
  add_chair(cloud, -0.3, 0.5), add_chair(cloud, 0.35, 0.5);  // pushed in
  const FoundObjects found = found_in(cloud);
  EXPECT_EQ(count_kind(found, ObjectKind::table), 1);
  EXPECT_EQ(count_kind(found, ObjectKind::chair), 2);
  for (const ModelObject& o : found.objects) {
    if (o.kind == ObjectKind::chair) {
      EXPECT_TRUE(o.movable);
      EXPECT_EQ(o.under, "table 1");
      EXPECT_NEAR(o.size.z(), 0.9, 0.08);
    }
  }
}

TEST(FindObjects, ThingsInARowPartWhereTheirHeightChanges) {
  cloud::PointCloud<Map> cloud;
  add_box(cloud, {0, 0, 0}, {1.8, 0.6, 0.9});
  add_box(cloud, {1.8, 0, 0}, {2.4, 0.6, 2.0});
  const FoundObjects found = found_in(cloud);
  EXPECT_EQ(count_kind(found, ObjectKind::counter), 1);
  EXPECT_EQ(count_kind(found, ObjectKind::cupboard), 1);
}

TEST(FindObjects, NoFurnitureOfRoomsStandsInAStreet) {
  cloud::PointCloud<Map> cloud;
  add_box(cloud, {0, 0, 0}, {1.8, 0.6, 0.9});
  add_box(cloud, {4, 0, 0}, {4.6, 0.6, 2.0});
  const FoundObjects found = find_objects(
      cloud, cloud.labels, {test::model_box("street", EntityLabel::floor, {0, 0, -0.05}, {40, 12, 0.1})});
  EXPECT_EQ(found.objects.size(), 2U);
  EXPECT_EQ(count_kind(found, ObjectKind::counter) + count_kind(found, ObjectKind::cupboard), 0);
}

TEST(FindObjects, WhatStandsBetweenTheArmsOfACornerIsNoPartOfIt) {
  cloud::PointCloud<Map> cloud;
  add_box(cloud, {0, 0, 0}, {2.6, 0.6, 0.9});
  add_box(cloud, {2.0, 0.6, 0}, {2.6, 3.0, 0.9});
  add_chair(cloud, 1.0, 1.5);
  const FoundObjects found = found_in(cloud);
  ASSERT_EQ(found.objects.size(), 3U);
  EXPECT_EQ(count_kind(found, ObjectKind::chair), 1);
  for (const ModelObject& o : found.objects) EXPECT_LT(o.size.y(), 0.7) << o.name;
}

TEST(FindObjects, WhatStandsOnATableIsOnIt) {
  cloud::PointCloud<Map> cloud;
  add_table(cloud, 0, 0);
  add_box(cloud, {-0.2, -0.2, 0.75}, {0.15, 0.15, 1.0});
  const FoundObjects found = found_in(cloud);
  ASSERT_EQ(found.objects.size(), 2U);
  const auto thing = std::find_if(found.objects.begin(), found.objects.end(),
                                  [](const ModelObject& o) { return o.kind != ObjectKind::table; });
  ASSERT_NE(thing, found.objects.end());
  EXPECT_EQ(thing->on, "table 1");
}

TEST(FindObjects, PointsOfTheBuildingBelongToNone) {
  cloud::PointCloud<Map> cloud;
  add_chair(cloud, 0, 0);
  const std::size_t chair = cloud.size();
  add_box(cloud, {3, 3, 0}, {3.1, 6, 2.5});
  std::fill(cloud.labels.begin() + static_cast<std::ptrdiff_t>(chair), cloud.labels.end(),
            static_cast<std::uint8_t>(EntityLabel::wall));
  const FoundObjects found = found_in(cloud);
  ASSERT_EQ(found.objects.size(), 1U);
  for (std::size_t i = chair; i < cloud.size(); ++i) ASSERT_EQ(found.object_of[i], kNoObject);
}

TEST(FindObjects, EachHasTheFeaturesThatItsKindWasChosenBy) {
  cloud::PointCloud<Map> cloud;
  add_table(cloud, 0, 0);
  add_box(cloud, {3, 3, 0}, {3.6, 4.5, 1.9});
  const FoundObjects found = found_in(cloud);
  ASSERT_EQ(found.features.size(), found.objects.size());
  for (std::size_t o = 0; o < found.objects.size(); ++o) {
    EXPECT_NEAR(found.features[o][0], found.objects[o].size.x(), 0.01);
    EXPECT_TRUE(std::all_of(found.features[o].begin(), found.features[o].end(),
                            [](float value) { return std::isfinite(value); }));
  }
}

TEST(FindObjects, APieceOfACeilingThatHangsLowerIsNone) {
  cloud::PointCloud<Map> cloud;
  add_box(cloud, {-1.2, -0.8, 2.3}, {1.2, 0.8, 2.4});
  std::vector<ModelEntity> entities = floor_of();
  entities.push_back(test::model_box("ceiling 1", EntityLabel::ceiling, {0, 0, 2.65}, {20, 20, 0.1}));
  EXPECT_TRUE(find_objects(cloud, cloud.labels, entities).objects.empty());
  ObjectOptions options;
  options.building_too = true;
  EXPECT_EQ(find_objects(cloud, cloud.labels, entities, options).objects.size(), 1U);
}

TEST(FindObjects, AThingAloneOnAFloorIsNoPieceOfTheBuilding) {
  for (const Eigen::Vector3d& size : {Eigen::Vector3d(1.2, 0.5, 1.9), {0.5, 0.4, 0.5}, {1.5, 0.8, 1.1}}) {
    cloud::PointCloud<Map> cloud;
    add_box(cloud, {0, 0, 0}, size);
    EXPECT_EQ(found_in(cloud).objects.size(), 1U) << size.transpose();
  }
}

TEST(FindObjects, APersonStandsSitsOrLies) {
  const auto posture_of = [](const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& boxes) {
    cloud::PointCloud<Map> cloud;
    for (const auto& [low, high] : boxes) add_box(cloud, low, high);
    const FoundObjects found = found_in(cloud);
    EXPECT_EQ(found.objects.size(), 1U);
    if (found.objects.empty()) return Posture::unknown;
    EXPECT_EQ(found.objects[0].kind, ObjectKind::person);
    EXPECT_FALSE(found.objects[0].movable);
    return found.objects[0].posture;
  };
  EXPECT_EQ(posture_of({{{-0.18, -0.1, 0}, {0.18, 0.1, 0.85}},
                        {{-0.24, -0.13, 0.85}, {0.24, 0.13, 1.45}},
                        {{-0.09, -0.1, 1.45}, {0.09, 0.1, 1.75}}}),
            Posture::standing);
  EXPECT_EQ(posture_of({{{-0.2, -0.2, 0}, {0.2, 0.2, 0.45}},
                        {{-0.18, -0.5, 0.45}, {0.18, 0.2, 0.6}},
                        {{-0.17, -0.5, 0}, {0.17, -0.38, 0.6}},
                        {{-0.24, -0.05, 0.6}, {0.24, 0.2, 1.08}},
                        {{-0.09, -0.05, 1.08}, {0.09, 0.15, 1.34}}}),
            Posture::sitting);
  EXPECT_EQ(posture_of({{{-0.18, -0.85, 0}, {0.18, 0, 0.16}},
                        {{-0.24, 0, 0}, {0.24, 0.26, 0.62}},
                        {{-0.09, 0.02, 0.62}, {0.09, 0.22, 0.9}}}),
            Posture::sitting)
      << "on the floor";
  EXPECT_EQ(posture_of({{{-0.88, -0.18, 0}, {-0.03, 0.18, 0.14}},
                        {{-0.03, -0.24, 0}, {0.57, 0.24, 0.23}},
                        {{0.57, -0.09, 0}, {0.87, 0.09, 0.22}}}),
            Posture::lying);
}

TEST(FindObjects, AnEmptyCloudHasNone) {
  const FoundObjects found = found_in({});
  EXPECT_TRUE(found.objects.empty());
  EXPECT_TRUE(found.object_of.empty());
}

}  // namespace
}  // namespace parhelion::semantic
