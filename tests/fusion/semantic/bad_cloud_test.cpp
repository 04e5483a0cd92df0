// Clouds in the wrong axes, units or places: what is reported of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <set>

#include "fusion/semantic/build_model.hpp"
#include "tests/fusion/semantic/clouds.hpp"

namespace parhelion::semantic {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

/// A room with a table and three scanners 1.5 m over its floor.
cloud::PointCloud<Cloud> placed_room() {
  test::CloudSampler sampler(250, 0.004, 31);
  sampler.room({0, 0}, {8, 6}, 0, 2.6);
  sampler.slab({5, 3}, {6.5, 4}, 0.74);
  cloud::PointCloud<Cloud> cloud;
  cloud.points = sampler.cloud().points;
  cloud.viewpoints = {{1, 1, 1.5}, {4, 4.6, 1.52}, {6.8, 2, 1.49}};
  for (std::size_t i = 0; i < cloud.size(); ++i) cloud.scans.push_back(static_cast<std::uint16_t>(i % 3));
  return cloud;
}

TEST(BadCloud, OneWithItsYAxisUpwardsIsRefusedAndTheSameUprightIsNot) {
  cloud::PointCloud<Cloud> cloud = placed_room();
  EXPECT_TRUE(build_model(cloud).ok());
  for (Eigen::Vector3f& p : cloud.points) p = {p.x(), p.z(), -p.y()};
  for (Eigen::Vector3d& p : cloud.viewpoints) p = {p.x(), p.z(), -p.y()};
  const auto built = build_model(cloud);
  ASSERT_FALSE(built.ok());
  EXPECT_THAT(built.error().message, HasSubstr("y axis upwards"));
}

TEST(BadCloud, OneThatIsTooLargeInAnyUnitIsNotTakenForMillimetres) {
  cloud::PointCloud<Cloud> cloud = placed_room();
  for (Eigen::Vector3f& p : cloud.points) p *= 1000;
  EXPECT_THAT(build_model(cloud).error().message, HasSubstr("millimetres"));
  for (Eigen::Vector3f& p : cloud.points) p *= 30'000;
  EXPECT_THAT(build_model(cloud).error().message, Not(HasSubstr("millimetres")));
}

TEST(BadCloud, OneFarFromItsOriginIsRoundedAndThatIsReported) {
  cloud::PointCloud<Cloud> cloud = placed_room();
  const Eigen::Vector3f far(32'000, 50'000, 0);
  for (Eigen::Vector3f& p : cloud.points) p += far;
  for (Eigen::Vector3d& p : cloud.viewpoints) p += far.cast<double>();
  const auto built = build_model(cloud);
  ASSERT_TRUE(built.ok()) << built.error().message;
  EXPECT_THAT(built->notes, Contains(HasSubstr("from its origin")));
  for (Eigen::Vector3f& p : cloud.points) p += 10 * far;
  EXPECT_THAT(build_model(cloud).error().message, HasSubstr("from its origin"));
}

/// Points as seen in turn by the three scanners of placed_room(), without what lies under their tripods.
cloud::PointCloud<Cloud> seen_by_tripods(const std::vector<Eigen::Vector3f>& points) {
  cloud::PointCloud<Cloud> cloud;
  cloud.viewpoints = placed_room().viewpoints;
  for (const Eigen::Vector3f& p : points) {
    const std::size_t view = cloud.size() % 3;
    const Eigen::Vector3f ray = p - cloud.viewpoints[view].cast<float>();
    if (ray.z() < -0.85F * ray.norm()) continue;
    cloud.points.push_back(p);
    cloud.scans.push_back(static_cast<std::uint16_t>(view));
  }
  return cloud;
}

/// Tripods in the middle of a stairwell, the lowest over its floor, others over landings with walls below
/// them.
cloud::PointCloud<Cloud> stairwell() {
  test::CloudSampler sampler(150, 0.004, 33);
  sampler.room({0, 0}, {8, 2.7}, 0, 10.4);
  for (const double z : {2.6, 5.2, 7.8}) {
    sampler.slab({0, 0}, {3, 2.7}, z);
    sampler.slab({5, 0}, {8, 2.7}, z - 1.3);
  }
  cloud::PointCloud<Cloud> cloud;
  cloud.viewpoints = {{1, 1.35, 1.3}, {7, 1.32, 5.6}, {1.2, 1.38, 7.2}, {6.8, 1.33, 8.8}};
  for (const Eigen::Vector3f& p : sampler.cloud().points) {
    const std::size_t view = cloud.size() % cloud.viewpoints.size();
    const Eigen::Vector3f ray = p - cloud.viewpoints[view].cast<float>();
    if (ray.z() < -0.85F * ray.norm()) continue;
    cloud.points.push_back(p);
    cloud.scans.push_back(static_cast<std::uint16_t>(view));
  }
  return cloud;
}

TEST(BadCloud, AStairwellIsNotTakenForACloudWithItsYAxisUpwards) {
  const auto built = build_model(stairwell());
  EXPECT_TRUE(built.ok()) << built.error().message;
}

/// A room with boards at a height.
std::vector<Eigen::Vector3f> room_of_boards(double height) {
  test::CloudSampler sampler(250, 0.004, 32);
  sampler.room({0, 0}, {8, 6}, 0, 3);
  for (double x = 0.5; x < 7; x += 1.5) sampler.slab({x, 1}, {x + 0.7, 4}, height);
  return sampler.cloud().points;
}

TEST(BadCloud, OneWhoseScannersSawWhatIsOverheadIsNotUpsideDown) {
  cloud::PointCloud<Cloud> cloud = seen_by_tripods(room_of_boards(2.2));
  EXPECT_TRUE(build_model(cloud).ok()) << "more hangs than stands, but nothing was seen under the tripods";
  cloud.viewpoints.clear(), cloud.scans.clear();
  EXPECT_FALSE(build_model(cloud).ok()) << "else the room is no test of the rule";
}

/// Views that look down and not up, with a gap of 80 degrees: turned over, they seem to see what is overhead.
TEST(BadCloud, OneOfViewsThatDoNotSeeAllAroundIsRefusedUpsideDown) {
  cloud::PointCloud<Cloud> turned;
  turned.viewpoints = placed_room().viewpoints;
  for (const Eigen::Vector3f& p : room_of_boards(0.75)) {
    const std::size_t view = turned.size() % 3;
    const Eigen::Vector3f ray = p - turned.viewpoints[view].cast<float>();
    if (ray.z() > 0.85F * ray.norm() || ray.x() < -0.77F * ray.head<2>().norm()) continue;
    turned.points.push_back(p);
    turned.scans.push_back(static_cast<std::uint16_t>(view));
  }
  for (Eigen::Vector3f& p : turned.points) p = {p.x(), -p.y(), -p.z()};
  for (Eigen::Vector3d& p : turned.viewpoints) p = {p.x(), -p.y(), -p.z()};
  const auto built = build_model(turned);
  ASSERT_FALSE(built.ok());
  EXPECT_THAT(built.error().message, HasSubstr("upside down"));
}

TEST(BadCloud, OneThatIsUpsideDownIsRefused) {
  const cloud::PointCloud<Cloud> cloud = seen_by_tripods(room_of_boards(0.75));
  EXPECT_TRUE(build_model(cloud).ok());
  for (const bool tripods : {true, false}) {
    cloud::PointCloud<Cloud> turned = cloud;
    for (Eigen::Vector3f& p : turned.points) p = {p.x(), -p.y(), -p.z()};
    for (Eigen::Vector3d& p : turned.viewpoints) p = {p.x(), -p.y(), -p.z()};
    if (!tripods) turned.viewpoints.clear(), turned.scans.clear();
    const auto built = build_model(turned);
    ASSERT_FALSE(built.ok()) << tripods;
    EXPECT_THAT(built.error().message, HasSubstr("upside down"));
  }
}

// The user must not look for stairs that such a map cannot show.
TEST(BadCloud, AMapOfLargeVoxelsReportsThatStairsAreNotFound) {
  for (const double voxel : {0.05, 0.1}) {
    cloud::PointCloud<Cloud> cloud;
    std::set<std::array<int, 3>> seen;
    for (const Eigen::Vector3f& p : placed_room().points) {
      const Eigen::Vector3i cube = (p / static_cast<float>(voxel)).array().floor().cast<int>();
      if (seen.insert({cube.x(), cube.y(), cube.z()}).second)
        cloud.points.push_back((cube.cast<float>().array() + 0.5F) * static_cast<float>(voxel));
    }
    const auto built = build_model(cloud);
    ASSERT_TRUE(built.ok()) << built.error().message;
    if (voxel > 0.08) {
      EXPECT_THAT(built->notes, Contains(HasSubstr("stairs are seldom found")));
    } else {
      EXPECT_THAT(built->notes, Not(Contains(HasSubstr("stairs"))));
    }
  }
}

}  // namespace
}  // namespace parhelion::semantic
