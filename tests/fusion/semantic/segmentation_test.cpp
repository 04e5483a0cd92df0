// The image-based pipeline from clouds to surfaces.
#include "fusion/semantic/segmentation/segmentation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "protocols/nearest_on_segment.hpp"
#include "tests/fusion/semantic/clouds.hpp"

namespace parhelion::semantic {
namespace {

using test::CloudSampler;
using testing::HasSubstr;

/// Distance of a point of the plan to a surface's segment.
double plane_distance(const VerticalSurface& surface, const Eigen::Vector2d& p) {
  return (nearest_on_segment(p, surface.start, surface.end) - p).norm();
}

/// The surface within `off` of both ends, or null.
const VerticalSurface* along(const Segmentation& s, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                             double off) {
  for (const VerticalSurface& surface : s.verticals) {
    if (plane_distance(surface, a) <= off && plane_distance(surface, b) <= off) return &surface;
  }
  return nullptr;
}

const HorizontalSurface* at_height(const Segmentation& s, double z, double off) {
  for (const HorizontalSurface& surface : s.horizontals) {
    if (std::abs(surface.z - z) <= off) return &surface;
  }
  return nullptr;
}

TEST(Segmentation, FindsWallsFloorAndCeilingOfARoom) {
  CloudSampler sampler(400, 0.005, 1);
  sampler.room({-2, -1.5}, {3, 2.5}, -1.3, 1.4);
  const auto found = segment(sampler.cloud());
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_EQ(found->verticals.size(), 4U);
  EXPECT_EQ(found->horizontals.size(), 2U);
  const std::vector<Eigen::Vector2d> corners = {{-2, -1.5}, {3, -1.5}, {3, 2.5}, {-2, 2.5}};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto* wall = along(*found, corners[i], corners[(i + 1) % 4], 0.05);
    ASSERT_NE(wall, nullptr) << "wall " << i;
    EXPECT_NEAR(wall->z_low, -1.3, 0.06);
    EXPECT_NEAR(wall->z_high, 1.4, 0.06);
    EXPECT_LT(wall->thickness, 0.03);
  }
  const auto* floor = at_height(*found, -1.3, 0.005);
  const auto* ceiling = at_height(*found, 1.4, 0.005);
  ASSERT_NE(floor, nullptr);
  ASSERT_NE(ceiling, nullptr);
  EXPECT_FALSE(floor->faces_down);
  EXPECT_TRUE(ceiling->faces_down);
  EXPECT_NEAR(floor->area, 20, 2);
  ASSERT_EQ(found->surface_of.size(), sampler.cloud().size());
  const auto left = std::count(found->surface_of.begin(), found->surface_of.end(), kNoSurface);
  EXPECT_LT(static_cast<double>(left), 0.01 * static_cast<double>(sampler.cloud().size()));
}

TEST(Segmentation, IsTheSameForAnyNumberOfThreads) {
  CloudSampler sampler(300, 0.01, 2);
  sampler.room({-9, -7}, {12, 8}, 0, 2.7);
  sampler.wall({0, -7}, {3, 8}, 0, 2.7);
  sampler.clutter({Eigen::Vector3d(-9, -7, 0), Eigen::Vector3d(12, 8, 2.7)}, 20'000);
  SegmentationOptions options;
  options.threads = 1;
  const auto one = segment(sampler.cloud(), options);
  options.threads = 2;
  const auto two = segment(sampler.cloud(), options);
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_EQ(one->surface_of, two->surface_of);
  ASSERT_EQ(one->verticals.size(), two->verticals.size());
  for (std::size_t i = 0; i < one->verticals.size(); ++i) {
    EXPECT_EQ(one->verticals[i].start, two->verticals[i].start);
    EXPECT_EQ(one->verticals[i].end, two->verticals[i].end);
    EXPECT_EQ(one->verticals[i].z_high, two->verticals[i].z_high);
  }
}

TEST(Segmentation, AWallAcrossTilesIsOneSegment) {
  CloudSampler sampler(400, 0.005, 3);
  sampler.wall({-14, 3}, {17, 6}, 0, 2.5);
  const auto found = segment(sampler.cloud());
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->verticals.size(), 1U);
  EXPECT_NE(along(*found, {-14, 3}, {17, 6}, 0.04), nullptr);
}

TEST(Segmentation, RefusesInvalidInput) {
  EXPECT_THAT(segment({}).error().message, HasSubstr("empty"));
  CloudSampler sampler(400, 0.005, 4);
  sampler.room({0, 0}, {4, 3}, 0, 2.6);
  SegmentationOptions options;
  options.pixel = -1;
  EXPECT_THAT(segment(sampler.cloud(), options).error().message, HasSubstr("pixel"));
  cloud::PointCloud<Map> millimetres = sampler.cloud();
  for (Eigen::Vector3f& p : millimetres.points) p *= 1000;
  EXPECT_THAT(segment(millimetres).error().message, HasSubstr("millimetres"));
}

TEST(Segmentation, ToleratesAnOutlier) {
  CloudSampler sampler(400, 0.005, 5);
  sampler.room({0, 0}, {4, 3}, 0, 2.6);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  cloud.points.insert(cloud.points.end(), {{1e6F, -1e6F, 3e5F}, {3e38F, 1, 1}, {1, 1, -3e38F}});
  const auto found = segment(cloud);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_EQ(found->verticals.size(), 4U);
  EXPECT_EQ(found->horizontals.size(), 2U);
  EXPECT_EQ(found->surface_of.back(), kNoSurface);
}

TEST(Segmentation, DuplicatesOfOnePointGiveNoSurface) {
  cloud::PointCloud<Map> cloud;
  cloud.points.assign(10'000, {1, 2, 3});
  const auto found = segment(cloud);
  ASSERT_TRUE(found.ok());
  EXPECT_TRUE(found->verticals.empty());
  EXPECT_TRUE(found->horizontals.empty());
}

cloud::PointCloud<Cloud> tilted_room(double degrees, bool furniture_on_top) {
  CloudSampler sampler(300, 0.005, 6);
  sampler.room({-3, -2}, {4, 3}, -1, 1.7);
  for (const double x : {-2.0, 0.0, 2.0}) {
    const double low = furniture_on_top ? 0.95 : -1, high = furniture_on_top ? 1.7 : -0.25;
    sampler.slab({x, -1}, {x + 1, 0}, furniture_on_top ? low : high);
    sampler.wall({x, -1}, {x + 0.7, -0.3}, low, high);
    sampler.clutter({Eigen::Vector3d(x, -1, low), Eigen::Vector3d(x + 1, 0, high)}, 2'000);
  }
  sampler.turn(
      Eigen::Isometry3d(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d(0.6, 0.8, 0))));
  cloud::PointCloud<Cloud> cloud;
  cloud.points = sampler.cloud().points;
  return cloud;
}

TEST(Levelling, TurnsATiltedRoomUpright) {
  for (const double degrees : {0.0, 0.7, -3.0, 12.0, 25.0}) {
    const auto T_map_cloud = level(tilted_room(degrees, false));
    ASSERT_TRUE(T_map_cloud.ok()) << degrees << ": " << T_map_cloud.error().message;
    const Eigen::Vector3d up =
        T_map_cloud->rotation() *
        Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d(0.6, 0.8, 0)) *
        Eigen::Vector3d::UnitZ();
    EXPECT_LT(std::acos(std::min(1.0, up.z())) * 180 / std::numbers::pi, 0.1) << degrees;
  }
}

TEST(Levelling, IsNotTiltedByAStepBetweenTwoFloors) {
  for (const double kerb : {0.08, 0.12, 0.16, 0.25}) {
    CloudSampler sampler(150, 0.005, 11);
    sampler.slab({0, 0}, {15, 9}, 0);
    sampler.slab({0, 9}, {15, 12.5}, kerb);
    sampler.wall({0, 12.5}, {15, 12.5}, kerb, 4);
    cloud::PointCloud<Cloud> cloud;
    cloud.points = sampler.cloud().points;
    const auto T_map_cloud = level(cloud);
    ASSERT_TRUE(T_map_cloud.ok()) << kerb << ": " << T_map_cloud.error().message;
    const double tilt = std::acos(std::min(1.0, T_map_cloud->rotation()(2, 2)));
    EXPECT_LT(tilt * 180 / std::numbers::pi, 0.1) << kerb;
  }
}

TEST(Segmentation, KeepsFloorsFromGrowingUpTheWalls) {
  // Sparse: the random content of a wall's slices differs by no more than 3 cm from one to the next.
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    CloudSampler sampler(420, 0.008, seed);
    sampler.room({0, 0}, {3.9, 7.2}, 1.76, 4.36);
    sampler.wall({2.5, 0}, {2.5, 5.04}, 1.76, 4.36);
    sampler.clutter({Eigen::Vector3d(0.3, 0.3, 1.76), Eigen::Vector3d(1.3, 1.3, 2.56)}, 1200);
    sampler.clutter({Eigen::Vector3d(-40, -40, -20), Eigen::Vector3d(40, 40, 20)}, 190);
    sampler.turn(Eigen::Isometry3d(Eigen::Translation3d(12.7, -8.7, 0) *
                                   Eigen::AngleAxisd(0.87, Eigen::Vector3d::UnitZ())));
    const auto found = segment(sampler.cloud());
    ASSERT_TRUE(found.ok());
    const HorizontalSurface* const floor = at_height(*found, 1.76, 0.01);
    ASSERT_NE(floor, nullptr) << "seed " << seed;
    EXPECT_NEAR(floor->area, 3.9 * 7.2, 3) << "seed " << seed;
  }
}

TEST(Levelling, ReportsAnUpsideDownCloud) {
  const auto found = level(tilted_room(2, true));
  ASSERT_FALSE(found.ok());
  EXPECT_THAT(found.error().message, HasSubstr("upside down"));
  EXPECT_TRUE(level(tilted_room(2, true), Eigen::Vector3d::UnitZ(), true).ok());
  EXPECT_FALSE(level(tilted_room(2, false), -Eigen::Vector3d::UnitZ()).ok());
}

/// A room with one table; `beams`: under its ceiling, `lowered`: half of its ceiling hangs 0.6 m lower.
cloud::PointCloud<Cloud> room_with_a_ceiling(bool beams, bool lowered) {
  CloudSampler sampler(300, 0.004, 12);
  sampler.room({0, 0}, {9, 6}, 0, 3.2);
  sampler.slab({2, 2}, {3.6, 2.8}, 0.74);
  for (double x = 1.2; beams && x < 8; x += 1.6) {
    sampler.slab({x, 0}, {x + 0.25, 6}, 2.85);
    sampler.wall({x, 0}, {x, 6}, 2.85, 3.2);
    sampler.wall({x + 0.25, 0}, {x + 0.25, 6}, 2.85, 3.2);
  }
  if (lowered) sampler.slab({5, 0}, {9, 6}, 2.6);
  cloud::PointCloud<Cloud> cloud;
  cloud.points = sampler.cloud().points;
  return cloud;
}

TEST(Levelling, NeitherBeamsNorALoweredCeilingHang) {
  for (const bool beams : {false, true}) {
    for (const bool lowered : {false, true}) {
      const auto found = level(room_with_a_ceiling(beams, lowered));
      EXPECT_TRUE(found.ok()) << beams << lowered;
    }
  }
}

TEST(Levelling, ReportsWhatItFoundWhereNothingIsLevel) {
  CloudSampler sampler(300, 0.005, 7);
  sampler.wall({0, 0}, {4, 0}, 0, 2.5);
  cloud::PointCloud<Cloud> cloud;
  cloud.points = sampler.cloud().points;
  EXPECT_THAT(level(cloud).error().message, HasSubstr("no level surface"));
  EXPECT_THAT(level(cloud::PointCloud<Cloud>()).error().message, HasSubstr("empty"));
  EXPECT_THAT(level(cloud, {0, 0, 2}).error().message, HasSubstr("length"));
}

}  // namespace
}  // namespace parhelion::semantic
