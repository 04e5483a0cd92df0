// Odometry that stands still from the start: a robot that drives off is followed by its scans, and one that
// stands among people is not thought to drive.
#include "fusion/pose/tracking/stuck_odometry.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "fusion/pose/matching/scan_points.hpp"
#include "fusion/pose/slam.hpp"
#include "tests/fusion/pose/corridors.hpp"
#include "tests/fusion/pose/corrupted_odometry.hpp"
#include "tests/fusion/pose/true_drive.hpp"

namespace parhelion::pose {
namespace {

RobotDescription robot_with_far_laser() {
  RobotDescription robot = test::robot_with_laser();
  robot.laser->beams = 361;
  robot.laser->angle_increment = -2 * robot.laser->angle_min / 360;
  robot.laser->convention.range_max = 20;
  return robot;
}

test::TrueBuilding ring(std::uint32_t seed) {
  test::CorridorOptions options;
  options.seed = seed;
  options.xs = {0, 30};
  options.ys = {0, 20};
  test::TrueBuilding building = test::corridor_building(options);
  building.route = {{2, 0}, {30, 0}, {30, 20}, {0, 20}, {0, 0}};
  return building;
}

/// Along the route at 1.5 m/s, five scans a second.
test::TrueDrive fast_drive(std::uint32_t seed) {
  test::TrueDriveOptions options;
  options.seed = seed;
  options.speed = 1.5;
  options.scan_period = 0.2;
  return test::true_drive(ring(seed), robot_with_far_laser(), options);
}

TEST(StuckOdometry, ARobotThatDrivesOffFastIsFollowedByItsScans) {
  for (const std::uint32_t seed : {3U, 4U, 11U}) {
    const test::TrueDrive drive = fast_drive(seed);
    auto slam = make_mapper(drive.robot, {});
    Pose2 T_true_map;
    double error = 0;
    std::size_t scans = 0, tracking = 0;
    for (test::DriveInput& input : test::inputs_of(drive)) {
      if (!input.scan) {
        input.odometry.T_odom_base = {};
        (*slam)->add(input.odometry);
      } else if (const auto estimate = (*slam)->add(*input.scan)) {
        const Pose2 truth = drive.at(estimate->stamp), found = planar(estimate->T_map_base);
        if (scans++ == 0) T_true_map = truth * found.inverse();
        error = std::max(error, ((T_true_map * found).position() - truth.position()).norm());
        tracking += estimate->state == SlamState::tracking ? 1 : 0;
      }
    }
    std::printf("seed %u: %.2f m, %zu of %zu tracking\n", seed, error, tracking, scans);
    // What nothing shows before the first things that recur in the corridor is not found again.
    EXPECT_LT(error, 0.8) << seed;
    EXPECT_GT(tracking, scans * 9 / 10) << seed;
    const auto findings = (*slam)->odometry_findings();
    EXPECT_TRUE(std::any_of(findings.begin(), findings.end(), [](const OdometryFinding& finding) {
      return finding.fault == OdometryFault::frozen;
    })) << seed;
  }
}

TEST(StuckOdometry, ARobotThatStandsAmongPeopleDoesNotDrive) {
  const RobotDescription robot = robot_with_far_laser();
  const MatchOptions options{.by_direction = true};
  const Eigen::Matrix3d prior = 5 * Eigen::Matrix3d::Identity();
  std::mt19937 random(17);
  std::size_t searched = 0;
  for (const std::uint32_t seed : {1U, 2U, 3U, 4U, 5U, 6U}) {
    const test::TrueBuilding building = ring(seed);
    // Its first second is that of a robot that stands.
    const test::TruePath path(building.route, 0.6);
    const Pose2 T_map_base = path.at(0);
    std::vector<test::Walker> people;
    const auto points_of = [&](double second) {
      const Scan scan = test::true_scan(building.now, people, robot, path, second, 0.01, random);
      return deskewed(scan, *robot.laser, {}).points;
    };
    SurfelMap map(0.1);
    map.add(points_of(0.5), T_map_base, 1);
    for (double phase = 0; phase < 6; phase += 1.5) people.push_back({1.5, phase, 0.2});
    StuckOdometry stuck;
    for (int i = 0; i < 30; ++i) {
      stuck.add({});
      for (test::Walker& walker : people) walker.phase += 0.1;
      const auto points = points_of(0.5);
      const Match standing = match(map, points, T_map_base, T_map_base, 1e4 * prior, options);
      EXPECT_FALSE(stuck.moved_off(map, points, T_map_base, standing, prior, options)) << seed << " " << i;
      searched += standing.cost > 20 ? 1 : 0;
    }
    EXPECT_FALSE(stuck.is_stuck());
  }
  EXPECT_GT(searched, 0U);
}

/// Of few points scans would follow a robot without odometry to a wrong place.
TEST(StuckOdometry, IsShownByScansOfManyPointsAlone) {
  const RobotDescription robot = robot_with_far_laser();
  const MatchOptions options{.by_direction = true};
  const Eigen::Matrix3d prior = 5 * Eigen::Matrix3d::Identity();
  std::mt19937 random(23);
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    const test::TrueBuilding building = ring(seed);
    const test::TruePath begin({{2, 0}, {30, 0}}, 0.6), ahead({{2.5, 0}, {30, 0}}, 0.6);
    const auto points_of = [&](const test::TruePath& path) {
      return deskewed(test::true_scan(building.now, {}, robot, path, 0.5, 0.01, random), *robot.laser, {})
          .points;
    };
    const Pose2 T_map_base = begin.at(0);
    SurfelMap map(0.1);
    map.add(points_of(begin), T_map_base, 1);
    for (const std::size_t count : {90U, 1000U}) {
      StuckOdometry stuck, once_moved;
      for (const double x : {0.0, 0.1})
        once_moved.add({SensorTime{} + seconds(x), transform<Odom, Base>(Pose2{x, 0, 0})});
      const auto moved_off = [&](StuckOdometry& odometry, const test::TruePath& path) {
        const auto points = thinned(points_of(path), count);
        const Match standing = match(map, points, T_map_base, T_map_base, 1e4 * prior, options);
        return odometry.moved_off(map, points, T_map_base, standing, prior, options);
      };
      EXPECT_FALSE(moved_off(once_moved, begin));
      EXPECT_FALSE(moved_off(once_moved, ahead)) << "odometry works";
      EXPECT_FALSE(once_moved.is_stuck());
      EXPECT_FALSE(moved_off(stuck, begin)) << seed;
      const auto found = moved_off(stuck, ahead);
      ASSERT_EQ(found.has_value(), count > 120) << seed << " " << count;
      EXPECT_EQ(stuck.is_stuck(), count > 120);
      if (!found) continue;
      EXPECT_LT((found->T_map_base.position() - ahead.at(0).position()).norm(), 0.1) << seed;
    }
  }
}

}  // namespace
}  // namespace parhelion::pose
