// Voxel maps: their spacing is found, and their surfaces become planes again.
#include "fusion/semantic/spread_voxels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/mean_sites/mean_scan.hpp"

namespace parhelion::semantic {
namespace {

using test::Device;
using test::SiteKind;

cloud::PointCloud<Cloud> cloud_of(Device device) {
  const test::MeanSite site = test::mean_site(SiteKind::office, 31);
  return test::mean_scan(site, device, 31).cloud;
}

TEST(VoxelSpacing, IsFoundForVoxelMapsOnly) {
  ASSERT_TRUE(voxel_spacing(cloud_of(Device::voxels_5cm)));
  EXPECT_NEAR(*voxel_spacing(cloud_of(Device::voxels_5cm)), 0.05, 0.002);
  ASSERT_TRUE(voxel_spacing(cloud_of(Device::voxels_10cm)));
  EXPECT_NEAR(*voxel_spacing(cloud_of(Device::voxels_10cm)), 0.10, 0.004);
  EXPECT_FALSE(voxel_spacing(cloud_of(Device::terrestrial)));
  EXPECT_FALSE(voxel_spacing(cloud_of(Device::depth_camera)));
  EXPECT_FALSE(voxel_spacing({}));
}

/// Centres of 10 cm cubes that a plane with the given slope passes through.
cloud::PointCloud<Cloud> sloping_plane(double slope) {
  cloud::PointCloud<Cloud> cloud;
  for (int x = 0; x < 60; ++x) {
    for (int y = 0; y < 60; ++y) {
      const double z = 0.1 * (std::floor(slope * x) + 0.5);
      cloud.points.emplace_back(0.1F * (static_cast<float>(x) + 0.5F), 0.1F * (static_cast<float>(y) + 0.5F),
                                static_cast<float>(z));
    }
  }
  return cloud;
}

TEST(SpreadVoxels, TakesStepsOfAVoxelOutOfASlope) {
  constexpr double kSlope = 0.2;
  const cloud::PointCloud<Cloud> steps = sloping_plane(kSlope);
  const SpreadCloud spread = spread_voxels(steps, 0.1);
  ASSERT_GT(spread.cloud.size(), 10 * steps.size());
  const auto spread_of = [&](const cloud::PointCloud<Cloud>& cloud) {
    double sum = 0, squares = 0;
    for (const Eigen::Vector3f& p : cloud.points) {
      const double d = static_cast<double>(p.z()) - kSlope * static_cast<double>(p.x());
      sum += d, squares += d * d;
    }
    const double n = static_cast<double>(cloud.size());
    return std::sqrt(squares / n - sum * sum / n / n);
  };
  EXPECT_LT(spread_of(spread.cloud), 0.6 * spread_of(steps));
}

/// m, the largest gap between the coordinates of points along an axis.
double largest_gap(const cloud::PointCloud<Cloud>& cloud, Eigen::Index axis) {
  std::vector<float> places;
  for (const Eigen::Vector3f& p : cloud.points) places.push_back(p[axis]);
  std::sort(places.begin(), places.end());
  float largest = 0;
  for (std::size_t i = 1; i < places.size(); ++i) largest = std::max(largest, places[i] - places[i - 1]);
  return static_cast<double>(largest);
}

TEST(SpreadVoxels, LeavesNoGapFromTheSideWithHalfOfTheCrossings) {
  constexpr std::size_t kCrossings = 36;  // 6 rows and 6 columns of 1.7 cm
  const cloud::PointCloud<Cloud> level = sloping_plane(0);
  const SpreadCloud spread = spread_voxels(level, 0.1);
  EXPECT_EQ(spread.cloud.size(), kCrossings / 2 * level.size());
  EXPECT_LT(largest_gap(spread.cloud, 0), 0.018);
  EXPECT_LT(largest_gap(spread.cloud, 1), 0.018);
}

// A sensor may report all that returned nothing in one place; a neighbourhood of all with all took minutes.
TEST(SpreadVoxels, IsNotMovedByManyPointsInOnePlaceFarAway) {
  cloud::PointCloud<Cloud> cloud = sloping_plane(0.3);
  const SpreadCloud alone = spread_voxels(cloud, 0.1, 2);
  cloud.points.insert(cloud.points.end(), 200'000, {-20, 0, 0});
  const SpreadCloud crowded = spread_voxels(cloud, 0.1, 2);
  ASSERT_GT(crowded.cloud.size(), alone.cloud.size() + 200'000);
  EXPECT_TRUE(std::equal(alone.cloud.points.begin(), alone.cloud.points.end(), crowded.cloud.points.begin()));
}

TEST(SpreadVoxels, IsTheSameForAnyNumberOfThreads) {
  const cloud::PointCloud<Cloud> voxels = cloud_of(Device::voxels_10cm);
  const SpreadCloud one = spread_voxels(voxels, 0.1, 1), two = spread_voxels(voxels, 0.1, 2);
  EXPECT_EQ(one.cloud.points, two.cloud.points);
  EXPECT_EQ(one.parent, two.parent);
}

TEST(SpreadVoxels, GivesEachVoxelTheLabelOfMostOfItsPoints) {
  SpreadCloud spread;
  spread.parent = {0, 0, 0, 1, 1};
  const std::vector<std::uint8_t> labels = {2, 3, 3, 1, 0};
  EXPECT_EQ(labels_of_parents(spread, labels, 2), (std::vector<std::uint8_t>{3, 0}));
}

TEST(SparseSpacing, IsOfThinnedScansOnly) {
  const cloud::PointCloud<Cloud> dense = cloud_of(Device::terrestrial);
  EXPECT_FALSE(sparse_spacing(dense));
  cloud::PointCloud<Cloud> thin;
  for (std::size_t i = 0; i < dense.size(); i += 12) thin.points.push_back(dense.points[i]);
  const auto spacing = sparse_spacing(thin);
  ASSERT_TRUE(spacing);
  EXPECT_GE(*spacing, 0.07);
  EXPECT_LE(*spacing, 0.13);
}

}  // namespace
}  // namespace parhelion::semantic
