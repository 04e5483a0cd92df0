#include "server/simulation/building/planar.hpp"

#include <gtest/gtest.h>

#include <random>

namespace parhelion::simulation {
namespace {

Footprint random_footprint(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Eigen::Vector2d> points;
  const int count = 1 + static_cast<int>(3 * (1 + unit(random)));
  const Eigen::Vector2d center(3 * unit(random), 3 * unit(random));
  for (int i = 0; i < count; ++i) points.emplace_back(center + Eigen::Vector2d(unit(random), unit(random)));
  Footprint footprint = make_polygon(convex_hull(points));
  footprint.radius = 0.3 * std::abs(unit(random));
  footprint.update_bound();
  return footprint;
}

/// Reference implementation: dense points on each outline, against those of the other.
double sampled_distance(const Footprint& a, const Footprint& b) {
  const auto outline = [](const Footprint& footprint) {
    std::vector<Eigen::Vector2d> points;
    for (std::size_t i = 0; i < footprint.vertices.size(); ++i) {
      const Eigen::Vector2d &from = footprint.vertices[i],
                            &to = footprint.vertices[(i + 1) % footprint.vertices.size()];
      for (int k = 0; k < 100; ++k) points.emplace_back(from + (to - from) * (k / 100.0));
    }
    return points;
  };
  double best = 1e9;
  for (const auto& p : outline(a)) {
    for (const auto& q : outline(b)) best = std::min(best, (p - q).norm());
  }
  return best - a.radius - b.radius;
}

TEST(Planar, DistanceAgreesWithDenseSampling) {
  std::mt19937 random(1);
  int apart = 0;
  for (int i = 0; i < 300; ++i) {
    const Footprint a = random_footprint(random), b = random_footprint(random);
    const double fast = signed_distance(a, b), slow = sampled_distance(a, b);
    EXPECT_NEAR(fast, signed_distance(b, a), 1e-12);
    EXPECT_LE(distance_bound(a, b), fast + 1e-12);
    if (fast + a.radius + b.radius <= 0) continue;  // the hulls overlap, whether or not their outlines cross
    ++apart;
    EXPECT_LE(fast, slow + 1e-9);
    EXPECT_NEAR(fast, slow, 0.03);
  }
  EXPECT_GT(apart, 100);
}

TEST(Planar, MovingByThePenetrationSeparatesTwoShapes) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> angle(0, 6.28);
  for (int i = 0; i < 200; ++i) {
    const Footprint a = random_footprint(random), b = random_footprint(random);
    const double depth = -signed_distance(a, b);
    if (depth <= a.radius + b.radius) continue;
    // No shorter translation in any direction.
    for (int k = 0; k < 64; ++k) {
      const double direction = angle(random);
      const Eigen::Vector2d shift = 0.99 * depth * Eigen::Vector2d(std::cos(direction), std::sin(direction));
      Footprint moved = a;
      for (Eigen::Vector2d& v : moved.vertices) v += shift;
      moved.update_bound();
      EXPECT_LE(signed_distance(moved, b), 1e-9);
    }
  }
}

TEST(Planar, AdvanceEqualsManySmallSteps) {
  for (const Twist2& twist :
       {Twist2{1, 0, 0}, Twist2{0.5, -0.2, 0.8}, Twist2{0, 0, 2}, Twist2{1, 0.3, 1e-9}}) {
    Pose2 small{1, 2, 0.5};
    constexpr int steps = 200000;
    for (int i = 0; i < steps; ++i) {
      const double dt = 1.5 / steps, yaw = small.yaw + twist.wz * dt / 2;
      small.x += (std::cos(yaw) * twist.vx - std::sin(yaw) * twist.vy) * dt;
      small.y += (std::sin(yaw) * twist.vx + std::cos(yaw) * twist.vy) * dt;
      small.yaw += twist.wz * dt;
    }
    const Pose2 whole = advance({1, 2, 0.5}, twist, 1.5);
    EXPECT_NEAR(whole.x, small.x, 1e-8);
    EXPECT_NEAR(whole.y, small.y, 1e-8);
    EXPECT_NEAR(whole.yaw, small.yaw, 1e-8);
  }
}

TEST(Planar, DistanceInLineWithASegmentIsToItsEnd) {
  const Footprint segment = make_segment({0, 0}, {0, 1}, 0.1);
  EXPECT_NEAR(signed_distance(segment, make_disc({0, 3}, 0.4)), 1.5, 1e-12);
  EXPECT_NEAR(signed_distance(make_disc({0, -2}, 0.4), segment), 1.5, 1e-12);
  EXPECT_NEAR(signed_distance(segment, make_segment({0, 2}, {0, 5}, 0)), 0.9, 1e-12);
  EXPECT_LT(signed_distance(segment, make_segment({0, 0.5}, {0, 5}, 0)), 0);
}

}  // namespace
}  // namespace parhelion::simulation
