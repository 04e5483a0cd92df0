// The 2D map of a laser at some height, from a cloud.
#include "fusion/semantic/slice.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace parhelion::semantic {
namespace {

/// A room from (0, 0) to (4, 3) with walls and a floor, seen from its middle; a table whose top is at 0.75 m.
cloud::PointCloud<Map> room() {
  cloud::PointCloud<Map> cloud;
  cloud.viewpoints = {{2, 1.5, 1.2}};
  const auto add = [&](double x, double y, double z) {
    cloud.points.emplace_back(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
  };
  for (double a = 0.01; a < 4; a += 0.02) {
    for (double z = 0.01; z < 2.5; z += 0.02) {
      add(a, 0, z), add(a, 3, z);
      if (a < 3) add(0, a, z), add(4, a, z);
    }
    for (double b = 0.01; b < 3; b += 0.02) {
      if (a > 0.3 && a < 2) add(a, b, 0);  // the floor was seen in one half only
    }
  }
  for (double x = 2.5; x < 3.5; x += 0.02) {
    for (double y = 2; y < 2.6; y += 0.02) add(x, y, 0.75);
  }
  return cloud;
}

float at(const pose::GridMap& map, double x, double y) {
  const auto column = static_cast<std::size_t>((x - map.x_min) / map.resolution),
             row = static_cast<std::size_t>((y - map.y_min) / map.resolution);
  return map.occupied.at(row * static_cast<std::size_t>(map.width) + column);
}

TEST(Slice, MarksWallsOccupiedSeenSpaceFreeAndTheRestUnknown) {
  const auto map = slice(room());
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(at(*map, 1, 0.01), 1.F);
  EXPECT_EQ(at(*map, 0.01, 1.5), 1.F);
  EXPECT_EQ(at(*map, 1, 1), 0.F) << "floor";
  EXPECT_EQ(at(*map, 3.8, 1.5), 0.F) << "lines of sight to the foot of the wall";
  EXPECT_EQ(at(*map, 3.0, 2.9), 0.F) << "behind the table's top, at the laser's height";
  EXPECT_EQ(at(*map, 2.05, 1.5), 0.5F) << "under the scanner nothing was seen";
}

TEST(Slice, ATableTopAppearsOnlyAtItsOwnHeight) {
  const auto low = slice(room());
  SliceOptions options;
  options.height = 0.75;
  const auto high = slice(room(), options);
  ASSERT_TRUE(low && high);
  EXPECT_NE(at(*low, 3, 2.3), 1.F);
  EXPECT_EQ(at(*high, 3, 2.3), 1.F);
}

TEST(Slice, WhatCarriesTheScannerIsNoObstacle) {
  cloud::PointCloud<Map> cloud = room();
  const Eigen::Vector3d& eye = cloud.viewpoints.front() = {2, 1.5, 0.4};
  for (double angle = 0; angle < 6.28; angle += 0.05) {
    for (const double range : {0.17, 0.62}) {
      for (const double up : {-0.05, 0.0, 0.05}) {
        const Eigen::Vector3d p = eye + Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), up);
        cloud.points.push_back(p.cast<float>());
      }
    }
  }
  const auto map = slice(cloud);
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_NE(at(*map, 2.17, 1.5), 1.F);
  EXPECT_EQ(at(*map, 2.62, 1.5), 1.F) << "a post around it";
  EXPECT_EQ(at(*map, 1, 0.01), 1.F);
  cloud.viewpoints.clear();
  EXPECT_EQ(at(*slice(cloud), 2.17, 1.5), 1.F) << "with an unknown scanner all points count";
}

TEST(Slice, ReportsErrors) {
  EXPECT_FALSE(slice({}));
  SliceOptions options;
  options.resolution = 0;
  EXPECT_FALSE(slice(room(), options));
  options.resolution = 1e-5;
  EXPECT_FALSE(slice(room(), options)) << "too many cells";
  options = {};
  options.floor = -30;
  EXPECT_FALSE(slice(room(), options)) << "nothing at that height";
}

}  // namespace
}  // namespace parhelion::semantic
