// Walls of which only a part is there or was seen, and clouds without a floor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fusion/semantic/net/semantic_net.hpp"
#include "tests/fusion/semantic/clouds.hpp"
#include "tests/fusion/semantic/net_of.hpp"

namespace parhelion::semantic {
namespace {

using test::CloudSampler;

/// m, of the walls that run along a segment, within 0.2 m of it.
double length_along(const SemanticNet& net, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = (b - a).normalized();
  double length = 0;
  for (const ModelEntity& e : net.entities) {
    const Eigen::Vector2d d = e.T_map_body.translation().head<2>() - a,
                          x = e.T_map_body.rotation().col(0).head<2>();
    const double at = along.dot(d), off = std::abs(along.x() * d.y() - along.y() * d.x());
    if (e.label == EntityLabel::wall && off < 0.2 && at > 0 && at < (b - a).norm() &&
        std::abs(along.dot(x)) > 0.98)
      length += e.size.x();
  }
  return length;
}

/// A hall with a room in its corner, whose thin walls are `top` m high.
CloudSampler hall(double top, std::uint64_t seed) {
  CloudSampler sampler(500, 0.004, seed);
  sampler.room({0, 0}, {12, 9}, 0, 7);
  for (const double off : {0.0, 0.1}) {
    sampler.wall({8 + off, 0}, {8 + off, 4}, 0, top);
    sampler.wall({8, 4 + off}, {12, 4 + off}, 0, top);
  }
  return sampler;
}

TEST(PartialWalls, ARoomInAHallHasWallsThoughTheyEndFarBelowItsCeiling) {
  for (const double top : {2.2, 2.7, 3.5}) {
    const SemanticNet net = net_of(hall(top, 3).cloud());
    EXPECT_GT(length_along(net, {8.05, -0.2}, {8.05, 4.2}), 3.5) << top;
    EXPECT_GT(length_along(net, {7.8, 4.05}, {12.2, 4.05}), 3.5) << top;
  }
}

TEST(PartialWalls, WhatHangsOverAWallInItsPlaneIsNoPartOfIt) {
  CloudSampler sampler = hall(2.7, 5);
  sampler.wall({8, 1.5}, {8, 2.5}, 4.2, 4.9);
  const SemanticNet net = net_of(sampler.cloud());
  std::size_t over = 0, walls = 0;
  for (std::size_t i = 0; i < net.labels.size(); ++i) {
    const Eigen::Vector3f& p = sampler.cloud().points[i];
    if (std::abs(p.x() - 8) > 0.03 || p.y() < 1.5 || p.y() > 2.5 || p.z() < 4 || p.z() > 5) continue;
    ++over;
    walls += net.labels[i] == static_cast<std::uint8_t>(EntityLabel::wall) ? 1 : 0;
  }
  ASSERT_GT(over, 100U);
  EXPECT_LT(walls, over / 10);
}

TEST(PartialWalls, ALowFaceAtTheEndOfASiteIsAWall) {
  CloudSampler sampler(500, 0.004, 7);
  sampler.slab({0, 0}, {9, 6}, 0);
  sampler.wall({0, 0}, {9, 0}, 0, 2.3);
  sampler.wall({0, 0}, {0, 6}, 0, 2.3);
  sampler.wall({0, 6}, {9, 6}, 0, 1.2);  // the camera looked down and past it
  const SemanticNet net = net_of(sampler.cloud());
  EXPECT_GT(length_along(net, {-0.2, 6}, {9.2, 6}), 8);
}

TEST(PartialWalls, ALowFaceWithinASiteIsNone) {
  CloudSampler sampler(500, 0.004, 9);
  sampler.room({0, 0}, {9, 6}, 0, 2.6);
  sampler.wall({3, 3}, {6, 3}, 0, 1.2);
  EXPECT_EQ(length_along(net_of(sampler.cloud()), {2.8, 3}, {6.2, 3}), 0);
}

/// A room of which only what lies between two heights is left, with a table and a seat.
SemanticNet sliced(double low, double high, double table) {
  CloudSampler sampler(700, 0.004, 11);
  sampler.room({0, 0}, {6, 5}, 0, 2.6);
  sampler.slab({2, 2}, {3.6, 2.8}, table);
  sampler.slab({2.6, 3.1}, {3.1, 3.6}, 0.45);
  cloud::PointCloud<Map> cloud;
  for (const Eigen::Vector3f& p : sampler.cloud().points) {
    if (static_cast<double>(p.z()) > low && static_cast<double>(p.z()) < high) cloud.points.push_back(p);
  }
  return net_of(cloud);
}

TEST(PartialWalls, WithoutAFloorATableIsNone) {
  const auto floors = [](const SemanticNet& net) {
    return std::count_if(net.entities.begin(), net.entities.end(),
                         [](const ModelEntity& e) { return e.label == EntityLabel::floor; });
  };
  for (const double table : {0.7, 0.9}) {
    EXPECT_EQ(floors(sliced(0.3, 2.0, table)), 0) << table;
    EXPECT_EQ(floors(sliced(-1, 2.0, table)), 1) << table;
  }
}

}  // namespace
}  // namespace parhelion::semantic
