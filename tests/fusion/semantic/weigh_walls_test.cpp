// Furniture that looks like a wall, told by the wall behind it.
#include "fusion/semantic/net/weigh_walls.hpp"

#include <gtest/gtest.h>

#include <random>

namespace parhelion::semantic {
namespace {

constexpr double kScore = 5;

/// An upright surface at x, seen from x = 0 and as far as `seen` of its cells.
WallCandidate surface(double x, double seen, double length = 3) {
  WallCandidate wall;
  wall.start = {x, 0}, wall.end = {x, length};
  wall.floor = 0, wall.ceiling = 2.5, wall.score = kScore;
  cloud::PointCloud<Map> cloud;
  cloud.viewpoints = {{0, 1.5, 1.2}};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> chance(0, 1);
  for (double y = 0.025; y < length; y += 0.05) {
    for (double z = 0.05; z < 2.5; z += 0.1) {
      if (chance(random) > seen) continue;
      cloud.points.emplace_back(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
      cloud.scans.push_back(0);
    }
  }
  wall.raster = rasterize(PlanPoints(cloud), wall.start, wall.end, 0, 2.5, 0.045);
  return wall;
}

std::vector<double> scores(std::vector<WallCandidate> walls) {
  weigh_walls(walls);
  std::vector<double> all;
  for (const WallCandidate& wall : walls) all.push_back(wall.score);
  return all;
}

TEST(WeighWalls, ASurfaceAsLongAsTheWallCloseBehindItAndFarWorseMeasuredIsAFront) {
  const auto all = scores({surface(2, 0.2), surface(2.15, 0.8)});
  EXPECT_LT(all[0], 0);
  EXPECT_EQ(all[1], kScore);
}

TEST(WeighWalls, OfTwoThatAreMeasuredAlikeNeitherIsAFront) {
  const auto all = scores({surface(2, 0.7), surface(2.15, 0.8)});
  EXPECT_EQ(all[0], kScore);
  EXPECT_EQ(all[1], kScore);
}

TEST(WeighWalls, AShorterOneIsAFrontHoweverWellItIsMeasured) {
  EXPECT_LT(scores({surface(2, 1, 2), surface(2.4, 0.6, 3)})[0], 0);
}

TEST(WeighWalls, WithRoomToStandBetweenThemBothAreWalls) {
  EXPECT_EQ(scores({surface(2, 0.2), surface(3.2, 0.8)})[0], kScore);
}

/// Facets of one arc through these places, a metre each, from the first to the last.
std::vector<WallCandidate> arc(const std::vector<Eigen::Vector2d>& corners) {
  std::vector<WallCandidate> facets;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    WallCandidate facet = surface(corners[i].x(), 1, 1);
    facet.start = corners[i], facet.end = corners[i + 1];
    facet.curve = 0;
    facet.round_length = static_cast<double>(corners.size() - 1);
    facets.push_back(facet);
  }
  return facets;
}

TEST(WeighWalls, AnArcThatAStraightWallExplainsIsNone) {
  std::vector<WallCandidate> walls = arc({{2.02, 0}, {2.08, 1}, {2.06, 2}, {1.9, 3}, {1.5, 3.9}});
  EXPECT_EQ(scores(walls)[0], kScore) << "alone it may be one";
  walls.push_back(surface(2.05, 1, 4));
  EXPECT_LT(scores(walls)[0], 0);
}

TEST(WeighWalls, AnArcThatPassesThroughAStraightWallIsNone) {
  const auto through = [](double from) {
    std::vector<WallCandidate> walls = arc({{0.6, 1.2}, {1.5, 1.6}, {2.5, 1.7}, {3.5, 1.6}, {4.4, 1.2}});
    WallCandidate straight = surface(2, 1, 3);
    straight.start.y() += from, straight.end.y() += from;
    walls.push_back(straight);
    return scores(walls)[0];
  };
  EXPECT_LT(through(0), 0);
  EXPECT_EQ(through(1.65), kScore) << "the straight one ends at it";
}

TEST(WeighWalls, AnArcStaysThatAStraightWallTouches) {
  std::vector<WallCandidate> walls = arc({{2.0, 0}, {2.0, 1}, {1.7, 2}, {1.1, 2.8}, {0.2, 3.2}});
  walls.push_back(surface(2.05, 1, 2));
  EXPECT_EQ(scores(walls)[0], kScore);
}

/// Facets around the origin, seen from outside or from inside.
std::vector<WallCandidate> ring(double radius, double turn, bool from_outside) {
  constexpr int kFacets = 12;
  std::vector<WallCandidate> facets;
  for (int k = 0; k < kFacets; ++k) {
    const auto corner = [&](int i) {
      const double at = turn * i / kFacets;
      return Eigen::Vector2d(radius * std::cos(at), radius * std::sin(at));
    };
    WallCandidate facet = surface(2, 1, 1);
    facet.start = corner(k), facet.end = corner(k + 1);
    const Eigen::Vector2d outwards = (facet.start + facet.end).normalized();
    facet.raster.away = from_outside ? (-outwards).eval() : outwards;
    facet.curve = 0, facet.round_length = radius * turn;
    facets.push_back(facet);
  }
  return facets;
}

TEST(WeighWalls, WhatIsRoundAndSeenFromOutsideIsATank) {
  EXPECT_LT(scores(ring(1, 4, true))[0], 0);
  EXPECT_EQ(scores(ring(1, 4, false))[0], kScore) << "the inside of a round room";
  EXPECT_GT(scores(ring(1, 2, true))[0], 0) << "a round corner";
  EXPECT_EQ(scores(ring(3, 4, true))[0], kScore) << "a round building";
}

/// An upright surface up to `top`, whose far side is in the direction `away`.
WallCandidate side(const Eigen::Vector2d& start, const Eigen::Vector2d& end, const Eigen::Vector2d& away,
                   double top) {
  WallCandidate wall;
  wall.start = start, wall.end = end;
  wall.floor = 0, wall.ceiling = top, wall.z_high = top, wall.score = kScore;
  wall.raster.start = start, wall.raster.along = (end - start).normalized(), wall.raster.away = away;
  return wall;
}

TEST(WeighWalls, SidesOfALowThingWhoseCornerPointsToTheScannerAreNone) {
  const auto corner = [](double top, double inwards) {
    return scores({side({0, 0}, {4, 0}, {0, inwards}, top), side({0, 0}, {0, 1.8}, {inwards, 0}, top)});
  };
  for (const double score : corner(1.4, 1)) EXPECT_LT(score, 0) << "a car";
  for (const double score : corner(2.4, 1)) EXPECT_GT(score, 0) << "a corner of a building";
  for (const double score : corner(1.4, -1)) EXPECT_GT(score, 0) << "the low part of a room's corner";
}

}  // namespace
}  // namespace parhelion::semantic
