// A wall is drawn where it is measured over its height, also in scans that end below the ceiling.
#include "fusion/semantic/net/wall_support.hpp"

#include <gtest/gtest.h>

namespace parhelion::semantic {
namespace {

constexpr double kSeen = 1.6;  // m: nothing is measured higher

/// Seen from (0, 0, 1.4): an upright front at x = 2 up to `top`, and a wall at x = 2.7 over it.
WallCandidate front_up_to(double top) {
  cloud::PointCloud<Map> cloud;
  const Eigen::Vector3d eye(0, 0, 1.4);
  cloud.viewpoints = {eye};
  for (double y = -0.99; y < 1; y += 0.02) {
    for (double z = 0.01; z < kSeen; z += 0.02) {
      const Eigen::Vector3d ray = Eigen::Vector3d(2, y, z) - eye;
      const double further = z < top ? 1 : 2.7 / 2;
      cloud.points.push_back((eye + further * ray).cast<float>());
      cloud.scans.push_back(0);
    }
  }
  WallCandidate wall;
  wall.start = {2, -1}, wall.end = {2, 1};
  wall.floor = 0, wall.ceiling = kSeen;
  wall.raster = rasterize(PlanPoints(cloud), wall.start, wall.end, 0, kSeen, 0.045);
  return wall;
}

TEST(WallSupport, AFrontThatRaysPassOverIsNoWall) {
  EXPECT_TRUE(supported_stretches(front_up_to(0.9), {}).empty()) << "of a counter";
  EXPECT_TRUE(supported_stretches(front_up_to(1.15), {}).empty()) << "of a bar";
}

TEST(WallSupport, WhatIsMeasuredUpToTheTopIsAWall) {
  const auto found = supported_stretches(front_up_to(kSeen), {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].from, 0, 0.1);
  EXPECT_NEAR(found[0].to, 2, 0.1);
}

}  // namespace
}  // namespace parhelion::semantic
