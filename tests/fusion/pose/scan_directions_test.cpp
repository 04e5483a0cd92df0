// Directions of the surfaces that a scan saw, and what matching makes of them.
#include "fusion/pose/matching/scan_directions.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "fusion/pose/matching/scan_match.hpp"

namespace parhelion::pose {
namespace {

std::vector<Eigen::Vector2d> line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double spacing) {
  std::vector<Eigen::Vector2d> points;
  const Eigen::Vector2d step = (to - from).normalized() * spacing;
  for (int i = 0; i * spacing <= (to - from).norm(); ++i) points.emplace_back(from + i * step);
  return points;
}

TEST(ScanDirections, AreThoseOfNoisyWallsAtAnySpacing) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.01);
  const Eigen::Vector2d along = Eigen::Vector2d(3, 1).normalized();
  for (const double spacing : {0.01, 0.03, 0.1, 0.3}) {
    auto points = line({2, -2}, Eigen::Vector2d(2, -2) + 4 * along, spacing);
    for (Eigen::Vector2d& p : points) p += Eigen::Vector2d(-along.y(), along.x()) * noise(random);
    std::vector<ScanDirection> directions;
    assign_directions(points, directions);
    ASSERT_EQ(directions.size(), points.size());
    std::size_t known = 0;
    for (const ScanDirection& direction : directions) {
      if (direction.along.isZero()) continue;
      ++known;
      EXPECT_GT(std::abs(direction.along.dot(along)), 0.94) << spacing;
    }
    EXPECT_GT(known, points.size() * 6 / 10) << spacing;
  }
}

TEST(ScanDirections, CornersEdgesAndSinglePointsHaveNone) {
  auto points = line({0, 1}, {1, 1}, 0.05);
  const std::size_t corner = points.size() - 1;
  for (const Eigen::Vector2d& p : line({1, 0.95}, {1, 0}, 0.05)) points.push_back(p);
  const std::size_t edge = points.size() - 1;
  points.emplace_back(5, 5);
  std::vector<ScanDirection> directions;
  assign_directions(points, directions);
  EXPECT_TRUE(directions.front().along.isZero());
  EXPECT_TRUE(directions[corner].along.isZero());
  EXPECT_TRUE(directions[edge].along.isZero());
  EXPECT_TRUE(directions.back().along.isZero());
  EXPECT_GT(std::abs(directions[corner / 2].along.x()), 0.99);
  EXPECT_GT(std::abs(directions[(corner + edge) / 2].along.y()), 0.99);
  assign_directions({}, directions);
  EXPECT_TRUE(directions.empty());
}

/// A scan in the middle of a corridor along x, 2 m wide, that ends `length` m ahead, with noise of 1 cm.
std::vector<Eigen::Vector2d> corridor_scan(double length, double degrees_per_beam) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.01);
  std::vector<Eigen::Vector2d> points;
  for (double degrees = -89.75; degrees < 90; degrees += degrees_per_beam) {
    const double angle = degrees * std::numbers::pi / 180;
    const double range = std::min(length / std::cos(angle), 1 / std::abs(std::sin(angle))) + noise(random);
    if (range < 30) points.emplace_back(range * std::cos(angle), range * std::sin(angle));
  }
  return points;
}

TEST(ScanDirections, WallsFarAheadHaveThemWhereBeamsMeetThemMetresApart) {
  for (const double degrees_per_beam : {0.5, 1.0}) {
    const auto points = corridor_scan(100, degrees_per_beam);
    std::vector<ScanDirection> directions;
    assign_directions(points, directions);
    int far = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points[i].x() < 10) continue;
      ++far;
      EXPECT_TRUE(directions[i].grazing) << points[i].transpose();
      EXPECT_GT(std::abs(directions[i].along.x()), 0.99) << points[i].transpose();
    }
    EXPECT_GE(far, 6);
  }
}

TEST(ScanDirections, TheEndOfACorridorIsNotTakenForItsSides) {
  for (const double length : {12.0, 18.0, 24.0}) {
    const auto points = corridor_scan(length, 1);
    std::vector<ScanDirection> directions;
    assign_directions(points, directions);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points[i].x() < length - 0.1 || std::abs(points[i].y()) > 0.8) continue;
      EXPECT_LT(std::abs(directions[i].along.x()), 0.2) << points[i].transpose();
    }
  }
}

/// A corridor of 12 m along x whose door at x = 0 to 1 stood open when it was mapped: its leaf was seen, and
/// the opening. Now it is shut.
struct ShutDoor {
  SurfelMap map{0.1};
  std::vector<Eigen::Vector2d> scan;

  ShutDoor() {
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0, 0.005);
    const auto noisy = [&](std::vector<Eigen::Vector2d> points) {
      for (Eigen::Vector2d& p : points) p += Eigen::Vector2d(noise(random), noise(random));
      return points;
    };
    for (int i = 0; i < 20; ++i) {
      map.add(noisy(line({-6, -1}, {6, -1}, 0.03)), {});
      map.add(noisy(line({-6, 1}, {0, 1}, 0.03)), {});
      map.add(noisy(line({1, 1}, {6, 1}, 0.03)), {});
      map.add(noisy(line({0.17, 1}, {0.17, 2}, 0.03)), {});
    }
    scan = noisy(line({-6, -1}, {6, -1}, 0.03));
    for (const Eigen::Vector2d& p : noisy(line({-6, 1}, {6, 1}, 0.03))) scan.push_back(p);
  }

  /// m: what the scan is drawn along the corridor, and how sure of it the match is (1 sigma).
  std::pair<double, double> drawn(bool by_direction) const {
    MatchOptions options;
    options.by_direction = by_direction;
    const Match found = match(map, scan, {}, {}, Eigen::Vector3d(25, 25, 100).asDiagonal(), options);
    return {std::abs(found.T_map_base.x), 1 / std::sqrt(std::max(1e-9, found.information(0, 0)))};
  }
};

TEST(ScanDirections, ADoorThatWasShutSinceDoesNotDrawTheRobotAlongTheCorridor) {
  const ShutDoor door;
  const auto [far, sure] = door.drawn(false);
  const auto [near, unsure] = door.drawn(true);
  std::printf("drawn by %.0f mm, sigma %.0f mm; by direction %.0f mm, sigma %.0f mm\n", 1e3 * far, 1e3 * sure,
              1e3 * near, 1e3 * unsure);
  EXPECT_LT(near, 0.04);
  EXPECT_LT(near, far / 3);
  EXPECT_GT(unsure, 1.5 * sure);
}

}  // namespace
}  // namespace parhelion::pose
