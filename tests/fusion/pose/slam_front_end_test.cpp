// Maps of drives whose truth is known, where a single step that goes wrong ruins all that follows: a laser
// that sweeps all the time, and tunnels.
#include "fusion/pose/mapping/slam_front_end.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <numbers>

#include "fusion/pose/slam.hpp"
#include "tests/fusion/pose/corrupted_odometry.hpp"
#include "tests/fusion/pose/estimate_error.hpp"

namespace parhelion::pose {
namespace {

struct FinalErrors {
  double error = 0;         ///< m, largest, of positions relative to the first pose
  double yaw_error = 0;     ///< rad, the same
  double causal_error = 0;  ///< m, as `error`, of the poses that were published while mapping
  std::size_t tracking = 0, scans = 0;
  std::size_t held = 0;  ///< of `tracking`, while mapping: the error lies in the 95 % ellipse
  std::vector<OdometryFinding> findings;
};

FinalErrors final_errors(const test::TrueDrive& drive, const std::vector<test::DriveInput>& inputs) {
  auto slam = make_mapper(drive.robot, {});
  FinalErrors result;
  std::optional<Pose2> T_true_first;
  for (const test::DriveInput& input : inputs) {
    if (!input.scan) {
      (*slam)->add(input.odometry);
    } else if (const auto estimate = (*slam)->add(*input.scan)) {
      ++result.scans;
      const Pose2 truth = drive.at(estimate->stamp);
      if (!T_true_first) T_true_first = truth * planar(estimate->T_map_base).inverse();
      const Eigen::Vector2d causal = (*T_true_first * planar(estimate->T_map_base)).position();
      result.causal_error = std::max(result.causal_error, (truth.position() - causal).norm());
      if (estimate->state != SlamState::tracking) continue;
      ++result.tracking;
      const auto error = test::planar_error(planar(estimate->T_map_base), T_true_first->inverse() * truth);
      if (test::holds_pose(test::planar_covariance(*estimate), error)) ++result.held;
    }
  }
  const auto trajectory = (*slam)->finish();
  const Pose2 T_true_map =
      drive.at(trajectory.front().stamp) * planar(trajectory.front().T_map_base).inverse();
  for (const PoseEstimate& estimate : trajectory) {
    const Pose2 off = drive.at(estimate.stamp).inverse() * T_true_map * planar(estimate.T_map_base);
    result.error = std::max(result.error, off.position().norm());
    result.yaw_error = std::max(result.yaw_error, std::abs(off.yaw));
  }
  result.findings = (*slam)->odometry_findings();
  return result;
}

/// All around, 7 times a second, each beam at its own time until the next scan begins.
RobotDescription robot_that_sweeps_all_the_time() {
  RobotDescription robot = test::robot_with_laser();
  robot.laser->beams = 360;
  robot.laser->angle_min = -std::numbers::pi;
  robot.laser->angle_increment = std::numbers::pi / 180;
  robot.laser->beam_interval = 1 / 7.0 / 360;
  robot.laser->convention.range_max = 12;
  return robot;
}

TEST(SlamFrontEnd, OdometryThatFailsDoesNotRuinTheMapOfALaserThatSweepsAllTheTime) {
  test::TrueDriveOptions options;
  options.scan_period = 1 / 7.0;
  options.odometry_late = 0.02;
  options.odometry_jitter = 0;
  options.range_sigma = 0.02;
  const test::TrueDrive drive = test::true_drive(test::office(5), robot_that_sweeps_all_the_time(), options);
  using enum test::Corruption;
  for (const test::Corruption fault : {frozen, translation_flipped, scaled_up, wheel_dead}) {
    const auto bad = test::corrupted(test::inputs_of(drive), fault, 0.3, 11);
    const FinalErrors map = final_errors(drive, bad.inputs);
    std::printf("%s: %.3f m, %zu of %zu tracking\n", test::kind_of(fault).name, map.error, map.tracking,
                map.scans);
    EXPECT_LT(map.error, 0.25) << test::kind_of(fault).name;
    EXPECT_FALSE(map.findings.empty()) << test::kind_of(fault).name;
  }
}

/// 80 m long and 3 m wide, with niches on one side; a scan sees single points of the walls far ahead.
test::TrueBuilding tunnel(std::uint32_t seed, int niches) {
  constexpr double length = 80, half = 1.5;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> where(10, length - 10);
  std::vector<double> at;
  for (int i = 0; i < niches; ++i) at.push_back(where(random));
  std::sort(at.begin(), at.end());
  test::TrueBuilding building;
  std::vector<test::Segment>& walls = building.mapped;
  walls.push_back({{0, -half}, {length, -half}});
  walls.push_back({{0, -half}, {0, half}});
  walls.push_back({{length, -half}, {length, half}});
  double x = 0;
  for (const double niche : at) {
    walls.push_back({{x, half}, {niche, half}});
    walls.push_back({{niche, half}, {niche, half + 0.4}});
    walls.push_back({{niche, half + 0.4}, {niche + 1.2, half + 0.4}});
    walls.push_back({{niche + 1.2, half + 0.4}, {niche + 1.2, half}});
    x = niche + 1.2;
  }
  walls.push_back({{x, half}, {length, half}});
  building.now = building.mapped;
  building.route = {{4, 0}, {length - 4, 0.1}, {4, -0.1}};
  return building;
}

/// Three people before the laser, each 60 beams wide, who walk past one another.
void put_people_before(Scan& scan, std::size_t number) {
  for (std::size_t person = 0; person < 3; ++person) {
    const std::size_t first = 20 + 100 * person + (person % 2 == 0 ? 9 * number : 60 - 9 * number);
    for (std::size_t i = first; i < first + 60; ++i)
      scan.ranges.at(i) = 1.0F + 0.1F * static_cast<float>(person);
  }
}

TEST(SlamFrontEnd, TakesNoRobotForPickedUpWhereItsFirstScansShowPeople) {
  test::TrueDriveOptions options;
  options.seed = 8;
  test::TrueBuilding building = test::office(8);
  building.route.resize(6);  // a hundred scans are enough
  const test::TrueDrive drive = test::true_drive(building, test::robot_with_laser(), options);
  SlamFrontEnd front_end(drive.robot, {});
  ScanOdometry odometry;
  std::size_t scans = 0;
  for (const test::DriveInput& input : test::inputs_of(drive)) {
    if (!input.scan) {
      front_end.add(odometry.add(input.odometry));
      continue;
    }
    const auto step = odometry.step_to(*input.scan, *drive.robot.laser);
    if (!step) continue;
    Scan scan = *input.scan;
    if (scans < 7) put_people_before(scan, scans);
    front_end.add(deskewed(scan, *drive.robot.laser, step->sweep), *step);
    ASSERT_FALSE(front_end.is_displaced()) << "scan " << scans;
    if (++scans == 100) return;
  }
  FAIL() << "the drive is too short";
}

/// After a loop the local map is made anew, a few keyframes a scan: a scan must not wait for all of them.
TEST(SlamFrontEnd, MakesTheMapAnewOverSomeScansAfterALoop) {
  test::TrueDriveOptions options;
  options.seed = 7;
  const test::TrueDrive drive = test::true_drive(test::office(7), test::robot_with_laser(), options);
  SlamFrontEnd front_end(drive.robot, {});
  ScanOdometry odometry;
  std::optional<Pose2> T_true_map;
  std::size_t scans = 0, before = 0;
  for (const test::DriveInput& input : test::inputs_of(drive)) {
    if (!input.scan) {
      front_end.add(odometry.add(input.odometry));
      continue;
    }
    const auto step = odometry.step_to(*input.scan, *drive.robot.laser);
    if (!step) continue;
    const std::size_t until_now = front_end.keyframes_in_map();
    const auto estimate = front_end.add(deskewed(*input.scan, *drive.robot.laser, step->sweep), *step);
    const Pose2 truth = drive.at(input.scan->stamp);
    if (!T_true_map) T_true_map = truth * estimate.T_map_base.inverse();
    ++scans;
    if (scans == 400) {
      before = front_end.keyframes_in_map();
      LoopCorrection same;
      for (const Keyframe& keyframe : front_end.keyframes()) same.poses.push_back(keyframe.T_map_base);
      front_end.correct(same);
      EXPECT_GT(before, 40U);
      EXPECT_LE(front_end.keyframes_in_map(), 13U);
    }
    if (scans < 400) continue;
    if (scans > 400 && until_now < before) {
      EXPECT_GT(front_end.keyframes_in_map(), until_now) << scans;
    }
    EXPECT_LE(front_end.keyframes_in_map(), until_now + 26) << scans;
    EXPECT_EQ(estimate.state, SlamState::tracking);
    EXPECT_LT(((*T_true_map * estimate.T_map_base).position() - truth.position()).norm(), 0.05) << scans;
    if (scans < 430) continue;
    EXPECT_GE(front_end.keyframes_in_map(), before);
    return;
  }
  FAIL() << "the drive is too short";
}

TEST(SlamFrontEnd, ATunnelKeepsItsLengthAndStaysStraight) {
  RobotDescription robot = test::robot_with_laser();
  robot.laser->beams = 181;
  robot.laser->angle_increment = std::numbers::pi / 180;
  robot.laser->beam_interval = 13.3e-3 / 181;
  test::TrueDriveOptions options;
  options.speed = 0.7;
  options.scan_period = 0.2;
  options.odometry_late = 0;
  options.odometry_jitter = 0;
  options.odometry_scale = 1.01;
  options.odometry_noise = 0.002;
  options.range_sigma = 0.01;
  for (const std::uint32_t seed : {1, 2, 3, 4}) {
    const test::TrueDrive drive = test::true_drive(tunnel(seed, seed % 2 == 0 ? 1 : 3), robot, options);
    const FinalErrors map = final_errors(drive, test::inputs_of(drive));
    std::printf("tunnel %u: %.2f m, %.4f rad, %zu of %zu in their ellipses, %zu findings\n", seed, map.error,
                map.yaw_error, map.held, map.tracking, map.findings.size());
    // Odometry is 0.7 m wrong at the far end, where nothing but odometry tells how far it is.
    EXPECT_LT(map.error, 1.6) << seed;
    EXPECT_LT(map.yaw_error, 0.02) << seed;
    EXPECT_TRUE(map.findings.empty()) << seed;
    EXPECT_GT(map.held, 0.75 * static_cast<double>(map.tracking)) << seed;
  }
}

struct BareCorridor {
  double length, half_width;  ///< m
  double range_max;           ///< m
  int beams;
  double field_of_view;  ///< rad
};

/// From end to end; odometry has this scale.
test::TrueDrive drive_in(const BareCorridor& corridor, double odometry_scale, double range_sigma = 0.01) {
  test::TrueDriveOptions options;
  options.seed = static_cast<std::uint32_t>(corridor.length);
  options.speed = 0.8;
  options.scan_period = 0.2;
  options.odometry_late = options.odometry_jitter = 0;
  options.odometry_scale = odometry_scale;
  options.odometry_noise = 0.002;
  options.range_sigma = range_sigma;
  RobotDescription robot = test::robot_with_laser();
  robot.laser->beams = corridor.beams;
  robot.laser->angle_min = -corridor.field_of_view / 2;
  robot.laser->angle_increment = corridor.field_of_view / (corridor.beams - 1);
  robot.laser->beam_interval = 13.3e-3 / corridor.beams;
  robot.laser->convention.range_max = static_cast<float>(corridor.range_max);
  test::TrueBuilding building;
  test::add_box(building.mapped, 0, -corridor.half_width, corridor.length, corridor.half_width);
  building.now = building.mapped;
  building.route = {{3, 0}, {corridor.length - 3, 0.1}};
  return test::true_drive(building, robot, options);
}

/// Walls far ahead, of which a scan sees single points, do not hold the robot back.
TEST(SlamFrontEnd, ABareCorridorHasTheLengthThatOdometryMeasures) {
  using std::numbers::pi;
  for (const BareCorridor& corridor :
       {BareCorridor{70, 1.1, 30, 181, pi}, {50, 0.9, 20, 361, pi}, {60, 1.4, 8, 181, pi}}) {
    const test::TrueDrive drive = drive_in(corridor, 1);
    const FinalErrors map = final_errors(drive, test::inputs_of(drive));
    std::printf("%.0f m, %d beams of %.0f m: %.2f m, %zu of %zu in their ellipses\n", corridor.length,
                corridor.beams, corridor.range_max, map.error, map.held, map.tracking);
    EXPECT_LT(map.error, 0.6) << corridor.length;
    EXPECT_EQ(map.tracking, map.scans) << corridor.length;
    EXPECT_TRUE(map.findings.empty()) << corridor.length;
    EXPECT_GT(map.held, 0.9 * static_cast<double>(map.tracking)) << corridor.length;
  }
}

/// The scans fit where the robot began, too, and there a little better, as the map there is older.
TEST(SlamFrontEnd, ScansThatShowNoMotionAlongACorridorDoNotContradictOdometry) {
  for (const std::uint32_t length : {88, 89, 90, 91}) {
    const BareCorridor corridor{static_cast<double>(length), 1.41, 30, 683, 1.5 * std::numbers::pi};
    const test::TrueDrive drive = drive_in(corridor, 0.97, 0.02);
    const FinalErrors map = final_errors(drive, test::inputs_of(drive));
    std::printf("%u m: %.2f m\n", length, map.error);
    EXPECT_LT(map.error, 4) << length;  // odometry is 2.5 m wrong
  }
}

/// Where only odometry tells how far the robot drove, its scale is one error for the whole way.
TEST(SlamFrontEnd, TheEllipseOfABareCorridorHoldsWhatTheScaleOfOdometryIsWrong) {
  using std::numbers::pi;
  for (const BareCorridor& corridor : {BareCorridor{65, 1.2, 10, 541, 1.5 * pi}, {55, 1.0, 6, 360, 2 * pi}}) {
    for (const double scale : {0.95, 1.05}) {
      const test::TrueDrive drive = drive_in(corridor, scale);
      const FinalErrors map = final_errors(drive, test::inputs_of(drive));
      std::printf("%.0f m, odometry %+.0f %%: %.2f m, %zu of %zu in their ellipses\n", corridor.length,
                  100 * (scale - 1), map.error, map.held, map.tracking);
      EXPECT_GT(map.held, 0.9 * static_cast<double>(map.tracking)) << corridor.length << " " << scale;
      EXPECT_EQ(map.tracking, map.scans) << corridor.length << " " << scale;
    }
  }
}

/// A furnished room, a bare corridor of 40 m, and another room: the scans in the room show odometry's scale.
test::TrueBuilding rooms_at_the_ends(std::uint32_t seed) {
  constexpr double half = 1.1, length = 40, room = 8, wall = 4;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> along(0.8, room - 0.8), across(half + 0.6, wall - 0.5), turned(0, 3);
  test::TrueBuilding building;
  std::vector<test::Segment>& walls = building.mapped;
  for (const double side : {-1.0, 1.0}) {
    walls.push_back({{0, side * half}, {length, side * half}});
    for (const double begin : {-room, length}) {
      walls.push_back({{begin, side * wall}, {begin + room, side * wall}});
      for (int i = 0; i < 3; ++i)
        test::add_turned_box(walls, {begin + along(random), side * across(random)}, {0.6, 0.4},
                             turned(random));
    }
    for (const double door : {0.0, length}) walls.push_back({{door, side * half}, {door, side * wall}});
  }
  for (const double end : {-room, length + room}) walls.push_back({{end, -wall}, {end, wall}});
  building.now = building.mapped;
  building.route = {{-6.5, 0.1}, {length + 6, -0.1}};
  return building;
}

TEST(SlamFrontEnd, LearnsTheScaleOfOdometryInARoomForTheCorridorBehindIt) {
  RobotDescription robot = test::robot_with_laser();
  robot.laser->convention.range_max = 12;
  for (const std::uint32_t seed : {1, 2, 3}) {
    for (const double scale : {0.94, 1.06}) {
      test::TrueDriveOptions options;
      options.seed = seed;
      options.speed = 0.7;
      options.scan_period = 0.2;
      options.odometry_late = options.odometry_jitter = 0;
      options.odometry_scale = scale;
      options.odometry_noise = 0.002;
      options.range_sigma = 0.01;
      const test::TrueDrive drive = test::true_drive(rooms_at_the_ends(seed), robot, options);
      const FinalErrors map = final_errors(drive, test::inputs_of(drive));
      std::printf("seed %u, odometry %+.0f %%: %.2f m causal, %.2f m final, %zu of %zu in their ellipses\n",
                  seed, 100 * (scale - 1), map.causal_error, map.error, map.held, map.tracking);
      // Odometry is 3 m wrong.
      EXPECT_LT(map.causal_error, 0.6) << seed << " " << scale;
      EXPECT_LT(map.error, 0.6) << seed << " " << scale;
      EXPECT_GT(map.held, 0.9 * static_cast<double>(map.tracking)) << seed << " " << scale;
      EXPECT_TRUE(map.findings.empty()) << seed << " " << scale;
    }
  }
}

/// The first of a ring's corridors was driven before any corner showed the scale.
TEST(SlamFrontEnd, TheFinalMapGivesTheScaleToMotionBeforeItWasKnown) {
  RobotDescription robot = test::robot_with_laser();
  robot.laser->convention.range_max = 10;
  for (const double scale : {0.93, 1.07}) {
    test::TrueDriveOptions options;
    options.speed = 0.8;
    options.scan_period = 0.2;
    options.odometry_late = options.odometry_jitter = 0;
    options.odometry_scale = scale;
    options.odometry_noise = 0.002;
    options.range_sigma = 0.01;
    constexpr double half = 1.2, x = 36, y = 18;
    test::TrueBuilding building;
    test::add_box(building.mapped, -half, -half, x + half, y + half);
    test::add_box(building.mapped, half, half, x - half, y - half);
    building.now = building.mapped;
    building.route = {{3, 0}, {x, 0}, {x, y}, {0, y}};
    const test::TrueDrive drive = test::true_drive(building, robot, options);
    const FinalErrors map = final_errors(drive, test::inputs_of(drive));
    std::printf("odometry %+.0f %%: %.2f m causal, %.2f m final\n", 100 * (scale - 1), map.causal_error,
                map.error);
    EXPECT_LT(map.error, 0.6) << scale;  // odometry is 2.3 m wrong at the first corner
    EXPECT_TRUE(map.findings.empty()) << scale;
  }
}

}  // namespace
}  // namespace parhelion::pose
