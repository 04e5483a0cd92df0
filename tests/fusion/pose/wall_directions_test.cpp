#include "fusion/pose/mapping/wall_directions.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <random>

#include "tests/fusion/pose/room.hpp"

namespace parhelion::pose {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// All around, each degree, in the robot's frame, with 1 cm of noise.
std::vector<Eigen::Vector2d> seen(const std::vector<test::Segment>& walls, const Pose2& T_map_base,
                                  unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.01);
  std::vector<Eigen::Vector2d> points;
  for (int degree = -180; degree < 180; ++degree) {
    const double angle = degree * kDegree;
    const double range = test::cast(walls, T_map_base.position(), T_map_base.yaw + angle) + noise(random);
    points.emplace_back(range * std::cos(angle), range * std::sin(angle));
  }
  return points;
}

std::vector<test::Segment> room(double turned) {
  const Eigen::Rotation2Dd turn(turned);
  const Eigen::Vector2d a(-4, -3), b(4, -3), c(4, 3), d(-4, 3);
  return {{turn * a, turn * b}, {turn * b, turn * c}, {turn * c, turn * d}, {turn * d, turn * a}};
}

RC_GTEST_PROP(WallDirections, ByHowMuchARoomIsTurnedIsSeenFromAnywhereInIt, ()) {
  const double directions = *rc::gen::inRange(-1800, 1800) * 0.1 * kDegree;
  const double off = *rc::gen::inRange(-20, 21) * 0.1 * kDegree;
  const unsigned seed = *rc::gen::inRange(0U, 1000U);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-1.5, 1.5), yaw(-3, 3);
  const auto walls = room(directions);
  WallDirections known;
  for (int i = 0; i < 8; ++i) {
    const Pose2 pose{place(random), place(random), yaw(random)};
    known.add(wall_pieces(seen(walls, pose, seed + 1000)), pose.yaw);
  }
  const Pose2 pose{place(random), place(random), yaw(random)};
  const auto turned = known.turned(wall_pieces(seen(walls, pose, seed)), pose.yaw + off);
  RC_ASSERT(turned.has_value());
  RC_ASSERT(std::abs(*turned - off) < 0.3 * kDegree);
}

TEST(WallDirections, AWallThatIsSeenForTheFirstTimeHasNoKnownDirection) {
  WallDirections known;
  EXPECT_FALSE(known.turned(std::vector<WallPiece>{{0.1, 4}}, 0));
  for (int i = 0; i < 20; ++i) known.add(std::vector<WallPiece>{{0.1, 4}}, 0);
  EXPECT_NEAR(known.turned(std::vector<WallPiece>{{0.1, 4}}, 0).value(), 0, 0.3 * kDegree);
  EXPECT_FALSE(known.turned(std::vector<WallPiece>{{0.5, 4}}, 0)) << "23 degrees beside it";
  EXPECT_FALSE(known.turned(std::vector<WallPiece>{{0.1, 1}}, 0)) << "too short";
}

TEST(WallDirections, ARoundRoomHasNoDirections) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-3, 3);
  WallDirections known;
  for (int i = 0; i < 500; ++i) known.add(std::vector<WallPiece>{{any(random), 1.5}}, any(random));
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(known.turned(std::vector<WallPiece>{{any(random), 3}}, 0));
}

TEST(WallDirections, HowFarWallsAreFromParallelIsMeasured) {
  std::mt19937 random(5);
  for (const double sigma : {0.3, 0.8}) {
    std::normal_distribution<double> off(0, sigma * kDegree);
    WallDirections known;
    for (int i = 0; i < 400; ++i)
      known.add(std::vector<WallPiece>{{off(random), 3}, {off(random) + std::numbers::pi / 2, 3}, {0.6, 2}},
                0.2);
    EXPECT_NEAR(std::sqrt(known.variance()) / kDegree, std::hypot(sigma, 0.2), 0.12) << sigma;
  }
}

TEST(WallDirections, PiecesEndAtCornersAndGaps) {
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i <= 30; ++i) points.emplace_back(0.1 * i, 2);
  for (int i = 1; i <= 20; ++i) points.emplace_back(3, 2 - 0.1 * i);
  for (int i = 0; i <= 20; ++i) points.emplace_back(4 + 0.1 * i, 0.1 * i);
  const auto pieces = wall_pieces(points);
  ASSERT_EQ(pieces.size(), 3U);
  const double expected[][2] = {{0, 3.0}, {std::numbers::pi / 2, 2.0}, {std::numbers::pi / 4, 2.83}};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sin(pieces[i].direction - expected[i][0]), 0, 0.02) << i;
    EXPECT_NEAR(pieces[i].length, expected[i][1], 0.15) << i;
  }
}

}  // namespace
}  // namespace parhelion::pose
