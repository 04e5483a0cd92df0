// A map that goes on where a robot has come to without seeing anything on the way.
#include "fusion/pose/mapping/new_ground.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "fusion/pose/slam.hpp"
#include "tests/fusion/pose/corrupted_odometry.hpp"
#include "tests/fusion/pose/estimate_error.hpp"
#include "tests/fusion/pose/trajectory_error.hpp"
#include "tests/fusion/pose/true_drive.hpp"

namespace parhelion::pose {
namespace {

constexpr double kOpenPlace = 25;  // m, more than the laser sees from both sides

/// Two halls whose open sides face each other over an open place.
test::TrueBuilding two_halls(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  test::TrueBuilding building;
  std::vector<test::Segment>& walls = building.mapped;
  const double right = 8 + kOpenPlace;
  for (const double x : {0.0, right}) {
    walls.push_back({{x, 0}, {x + 8, 0}});
    walls.push_back({{x, 8}, {x + 8, 8}});
    const double back = x == 0 ? 0 : x + 8;
    walls.push_back({{back, 0}, {back, 8}});
    for (int i = 0; i < 4; ++i)
      test::add_turned_box(walls, {x + 1 + 6 * unit(random), (i % 2 == 0 ? 1 : 6) + unit(random)},
                           {0.4 + 0.8 * unit(random), 0.3 + 0.4 * unit(random)}, 3 * unit(random));
  }
  building.now = walls;
  building.route = {{2, 4}, {7, 4}, {right + 2, 4}, {right + 6, 4}, {right + 6, 5}, {right + 2, 4}};
  return building;
}

RobotDescription near_sighted_robot() {
  RobotDescription robot = test::robot_with_laser();
  robot.laser->convention.range_max = 6;
  return robot;
}

struct SecondHall {
  int scans = 0, known = 0, tracking = 0, held = 0;  ///< in it: all, with a pose, tracking, in their ellipse
};

/// `wheels`: of what odometry reports in the open place to what was driven.
SecondHall crossed(std::uint32_t seed, double wheels) {
  const RobotDescription robot = near_sighted_robot();
  test::TrueDriveOptions options;
  options.seed = seed;
  options.odometry_late = options.odometry_jitter = 0;
  options.odometry_scale = 1.01;
  const test::TrueDrive drive = test::true_drive(two_halls(seed), robot, options);
  auto slam = make_mapper(robot, {});
  SecondHall hall;
  std::size_t next = 0;
  std::optional<Pose2> before;
  Pose2 odom;
  for (const test::DriveInput& in : test::inputs_of(drive)) {
    if (!in.scan) {
      Odometry odometry = in.odometry;
      const Pose2 now = planar(odometry.T_odom_base);
      Pose2 step = before ? before->inverse() * now : Pose2{};
      if (now.x > 12 && now.x < 8 + kOpenPlace + 4) step.x *= wheels;
      before = now;
      odom = odom * step;
      odometry.T_odom_base = transform<Odom, Base>(odom);
      (*slam)->add(odometry);
      continue;
    }
    const test::TrueScan& scan = drive.scans[next++];
    const auto estimate = (*slam)->add(*in.scan);
    if (!estimate || scan.T_map_base.x < 8 + kOpenPlace + 1) continue;
    ++hall.scans;
    if (estimate->state == SlamState::lost) continue;
    ++hall.known;
    hall.tracking += estimate->state == SlamState::tracking;
    const Eigen::Matrix3d covariance = test::planar_covariance(*estimate);
    const Pose2 truth = drive.scans.front().T_map_base.inverse() * scan.T_map_base;
    hall.held += test::holds_position(covariance, test::planar_error(planar(estimate->T_map_base), truth));
  }
  return hall;
}

TEST(NewGround, BeyondAnOpenPlaceTheMapGoesOn) {
  std::uint32_t seed = 0;
  for (const double wheels : {0.95, 1.0, 1.05}) {
    const SecondHall hall = crossed(++seed, wheels);
    ASSERT_GT(hall.scans, 100);
    EXPECT_GT(hall.known, 0.8 * hall.scans) << seed;
    EXPECT_EQ(hall.tracking, 0) << "odometry alone says where the hall is";
    EXPECT_GT(hall.held, 0.9 * hall.known) << seed;
  }
}

/// Scans of a hall along a straight way, put where odometry says that they are.
bool is_accepted(double odometry_scale) {
  const test::TrueBuilding hall = two_halls(4);
  RobotDescription robot = near_sighted_robot();
  robot.laser->beam_interval = 0;
  const test::TruePath path({{2, 4}, {6.5, 4}}, 0.6);
  std::mt19937 random(4);
  NewGround ground(0.1);
  bool accepted = false;
  for (double t = 2; t < 5; t += 0.1) {
    const Scan scan = test::true_scan(hall.now, {}, robot, path, t, 0.01, random);
    const Pose2 truth = path.at(t);
    const ScanPoints points = deskewed(scan, *robot.laser, Twist2{});
    accepted |= ground.add(points, {odometry_scale * truth.x, truth.y, truth.yaw}, {.by_direction = true});
  }
  return accepted;
}

TEST(NewGround, ScansThatContradictOdometryDoNotGoIntoTheMap) {
  for (const double right : {0.97, 1.0, 1.03}) EXPECT_TRUE(is_accepted(right)) << right;
  for (const double wrong : {0.0, 0.5, 0.7, 1.4, 2.0}) EXPECT_FALSE(is_accepted(wrong)) << wrong;
}

}  // namespace
}  // namespace parhelion::pose
