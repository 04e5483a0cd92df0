#include "fusion/pose/maps/seen_area.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace parhelion::pose {
namespace {

/// Beams from the middle of a room of 10 m x 10 m to its walls, one per degree.
SeenArea seen_room(const Eigen::Vector2d& centre, double reach) {
  SeenArea seen(centre, reach);
  for (int degree = 0; degree < 360; ++degree) {
    const double angle = degree * 3.14159265358979 / 180;
    const Eigen::Vector2d d(std::cos(angle), std::sin(angle));
    seen.add_beam({0, 0}, d * (5 / d.cwiseAbs().maxCoeff()));
  }
  return seen;
}

TEST(SeenArea, HoldsWhereBeamsHavePassed) {
  const SeenArea seen = seen_room({0, 0}, 6);
  for (const Eigen::Vector2d& p : {Eigen::Vector2d(0, 0), {2, 1}, {-3, 3}, {4, -2}})
    EXPECT_TRUE(seen.is_inside(p)) << p.transpose();
}

TEST(SeenArea, HoldsNeitherWallsNorWhatIsBehindThem) {
  const SeenArea seen = seen_room({0, 0}, 6);
  for (const Eigen::Vector2d& p : {Eigen::Vector2d(5, 0), {5.2, 1}, {5.8, 0}, {0, -5}, {-5.5, 5.5}})
    EXPECT_FALSE(seen.is_inside(p)) << p.transpose();
}

TEST(SeenArea, HoldsNothingOutsideOfItsSquare) {
  const SeenArea seen = seen_room({1, 0}, 2);
  EXPECT_TRUE(seen.is_inside({2, 0}));
  EXPECT_TRUE(seen_room({0, 0}, 6).is_inside({3.5, 0}));
  for (const double x : {-1.5, 3.5, 1e9, -1e300, std::nan("")}) EXPECT_FALSE(seen.is_inside({x, 0})) << x;
  EXPECT_FALSE(SeenArea().is_inside({0, 0}));
}

TEST(SeenArea, KeepsTheNearPartOfABeamWithoutEnd) {
  SeenArea seen({0, 0}, 3);
  for (double y = -1; y <= 1; y += 0.1) seen.add_beam({-1, y}, {1e30, y});
  EXPECT_TRUE(seen.is_inside({2.5, 0}));
  EXPECT_FALSE(seen.is_inside({-2, 0}));
}

}  // namespace
}  // namespace parhelion::pose
