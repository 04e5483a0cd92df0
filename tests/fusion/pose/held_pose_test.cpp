// Maps that grow with their scans where a scan shows little: a camera's view along bare walls.
#include "fusion/pose/tracking/held_pose.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "fusion/pose/matching/scan_match.hpp"
#include "tests/fusion/pose/room.hpp"

namespace parhelion::pose {
namespace {

/// 57 degrees, 4 m, with the noise of a structured-light camera: sigma 3 mm + 2 mm/m^2.
std::vector<Eigen::Vector2d> camera_points(const std::vector<test::Segment>& walls, double x,
                                           std::mt19937& random) {
  constexpr int beams = 320;
  constexpr double view = 57 * std::numbers::pi / 180, range_max = 4;
  std::normal_distribution<double> unit;
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < beams; ++i) {
    const double angle = view * (i / (beams - 1.0) - 0.5), range = test::cast(walls, {x, 0.1}, angle);
    const double seen = range + (0.003 + 0.002 * range * range) * unit(random);
    if (seen < range_max) points.emplace_back(seen * std::cos(angle), seen * std::sin(angle));
  }
  return points;
}

/// m, along a bare corridor, of a robot that drives 3 m with exact odometry and maps what it sees.
double error_along_corridor(bool growing, std::uint32_t seed) {
  constexpr double step = 0.02, kept_after = 0.14;
  std::vector<test::Segment> walls;
  test::add_box(walls, -20, -0.8, 40, 0.8);
  std::mt19937 random(seed);
  SurfelMap map(0.1);
  MatchOptions options;
  options.by_direction = true;
  options.growing = growing;
  Pose2 pose{0, 0.1, 0};
  Eigen::Matrix3d covariance = Eigen::Vector3d(1e-6, 1e-6, 1e-6).asDiagonal();
  double kept = 0;
  map.add(camera_points(walls, 0, random), pose);
  for (double x = step; x < 3; x += step) {
    const auto points = camera_points(walls, x, random);
    const Pose2 expected = pose * Pose2{step, 0, 0};
    covariance += Eigen::Vector3d(1e-4, 1e-4, 1e-4).asDiagonal();
    const Match found = match(map, points, expected, expected, covariance.inverse(), options);
    pose = found.T_map_base;
    covariance = (covariance.inverse() + found.information).inverse();
    if (x - kept < kept_after) continue;
    map.add(points, pose);
    kept = x;
  }
  return pose.x - 2.98;
}

TEST(GrowingMap, ABareCorridorDoesNotDrawACameraBack) {
  double drawn = 0, left = 0;
  for (const std::uint32_t seed : {1, 2, 3, 4}) {
    drawn += std::abs(error_along_corridor(false, seed)) / 4;
    left += std::abs(error_along_corridor(true, seed)) / 4;
  }
  std::printf("%.3f m, growing %.3f m\n", drawn, left);
  EXPECT_LT(left, 0.05);
  EXPECT_LT(left, drawn / 4);
}

ScanTracking::Followed followed(const Pose2& expected, const Pose2& matched, double along_sigma) {
  ScanTracking::Followed found;
  found.expected = {expected, Eigen::Vector3d(4e-4, 4e-4, 1e-4).asDiagonal()};
  found.match.T_map_base = matched;
  found.match.information =
      Eigen::Vector3d(1 / (along_sigma * along_sigma), 1 / (0.005 * 0.005), 1 / (0.002 * 0.002)).asDiagonal();
  return found;
}

/// 2 m at 4 cm a scan; each match finds the robot 5 mm behind where odometry predicts it.
Pose2 end_of_drive(HeldPose& held, double along_sigma) {
  Estimate2 now{{}, Eigen::Vector3d(1e-6, 1e-6, 1e-6).asDiagonal()};
  const Pose2 step{0.04, 0, 0};
  for (int i = 0; i < 50; ++i) {
    const Pose2 expected = now.T_map_base * step;
    now = held.after(now, followed(expected, {expected.x - 0.005, expected.y, 0}, along_sigma), step);
  }
  return now.T_map_base;
}

TEST(HeldPose, MatchesWithOneAndTheSameErrorDoNotDrawTheRobotAlongAWall) {
  HeldPose held(test::robot_with_laser(), {0.05, 1});
  EXPECT_NEAR(end_of_drive(held, 0.2).x, 2, 0.1);
}

TEST(HeldPose, SurfacesThatDetermineThePoseWinAgainstOdometry) {
  HeldPose held(test::robot_with_laser(), {0.05, 1});
  EXPECT_NEAR(end_of_drive(held, 0.005).x, 1.75, 0.05);
}

TEST(HeldPose, OdometryThatWasWrongHoldsNoRobot) {
  HeldPose held(test::robot_with_laser(), {0.05, 1});
  end_of_drive(held, 0.005);
  EXPECT_FALSE(held.is_odometry_good());
  EXPECT_LT(end_of_drive(held, 0.2).x, 1.85);
}

}  // namespace
}  // namespace parhelion::pose
