#include "fusion/pose/seen_area.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace parhelion::pose {
namespace {

/// Beams from the middle of a room of 10 m x 10 m to its walls, one per degree.
SeenArea seen_room() {
  SeenArea seen({-6, -6}, {6, 6});
  for (int degree = 0; degree < 360; ++degree) {
    const double angle = degree * 3.14159265358979 / 180;
    const Eigen::Vector2d d(std::cos(angle), std::sin(angle));
    seen.add_beam({0, 0}, d * (5 / d.cwiseAbs().maxCoeff()));
  }
  return seen;
}

TEST(SeenArea, HoldsWhereBeamsHavePassedOnAllSides) {
  const SeenArea seen = seen_room();
  for (const Eigen::Vector2d& p : {Eigen::Vector2d(0, 0), {2, 1}, {-3, 3}, {4, -2}})
    EXPECT_TRUE(seen.is_inside(p)) << p.transpose();
}

TEST(SeenArea, HoldsNeitherWallsNorWhatIsBehindThem) {
  const SeenArea seen = seen_room();
  for (const Eigen::Vector2d& p : {Eigen::Vector2d(5, 0), {5.2, 1}, {5.8, 0}, {0, -5}, {-5.5, 5.5}})
    EXPECT_FALSE(seen.is_inside(p)) << p.transpose();
}

TEST(SeenArea, HoldsNothingOutsideOfItsRectangle) {
  SeenArea seen({-1, -1}, {1, 1});
  seen.add_beam({-100, 0.1}, {100, 0.1});
  for (const double far : {-50.0, -1.1, 1.6, 1e9}) EXPECT_FALSE(seen.is_inside({far, 0}));
  EXPECT_FALSE(SeenArea().is_inside({0, 0}));
}

}  // namespace
}  // namespace parhelion::pose
