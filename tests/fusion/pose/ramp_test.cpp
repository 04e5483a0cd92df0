// SLAM on a robot that drives over a ramp.
#include <gtest/gtest.h>

#include "fusion/pose/matching/scan_points.hpp"
#include "fusion/pose/slam.hpp"
#include "protocols/quantile.hpp"
#include "tests/fusion/pose/room.hpp"

namespace parhelion::pose {
namespace {

constexpr double kSlope = 18 * std::numbers::pi / 180;
constexpr double kFoot = 8, kTop = 12, kEnd = 16;  ///< m, x of a ramp up and down again
constexpr double kLaserHeight = 0.3;

struct Ground {
  double (*height)(double x);  ///< m
  double (*pitch)(double x);   ///< of a robot on it that faces along x; nose up is negative (REP-103)
};

double ramp_height(double x) {
  if (x < kFoot || x > kEnd) return 0;
  return std::tan(kSlope) * (x < kTop ? x - kFoot : kEnd - x);
}

/// Over half a metre around each bend, as the axles pass it one by one.
double ramp_pitch(double x) {
  const auto bend = [x](double at) { return std::clamp((x - at) / 0.5 + 0.5, 0.0, 1.0); };
  return kSlope * (-bend(kFoot) + 2 * bend(kTop) - bend(kEnd));
}

/// Rubble too small for the laser to see, which tilts the robot.
constexpr Ground kRubble{[](double) { return 0.0; },
                         [](double x) { return x < 4 ? 0 : kSlope * std::sin(1.7 * (x - 4)); }};
constexpr Ground kRamp{ramp_height, ramp_pitch};

/// 24 m x 7 m, with niches and pillars along the walls.
std::vector<test::Segment> hall() {
  std::vector<test::Segment> walls;
  test::add_box(walls, 0, 0, 24, 7);
  double x = 1.3;
  for (int i = 0; i < 9; ++i, x += 2.1 + 0.2 * (i % 3)) {
    test::add_box(walls, x, 0, x + 0.5 + 0.1 * (i % 4), 0.4 + 0.1 * (i % 2));
    test::add_box(walls, x + 0.8, 6.6 - 0.1 * (i % 3), x + 1.2, 7);
  }
  return walls;
}

/// The range to a wall or to the floor, whichever is nearer.
double range_in_hall(const Ground& ground, const std::vector<test::Segment>& walls,
                     const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
  const double level = direction.head<2>().norm();
  const double wall = test::cast(walls, from.head<2>(), std::atan2(direction.y(), direction.x()));
  for (double d = 0; d < wall; d += 0.02) {
    if (from.z() + d * direction.z() / level < ground.height(from.x() + d * direction.x() / level))
      return d / level;
  }
  return wall / level;
}

Scan scan_on(const Ground& ground, const std::vector<test::Segment>& walls, const LaserDescription& laser,
             const Pose2& pose, SensorTime stamp, std::mt19937& random) {
  const auto level = Transform<Map, Base>::planar(pose.x, pose.y, pose.yaw, ground.height(pose.x));
  const auto T_map_laser = with_attitude(level, {0, ground.pitch(pose.x)}) * laser.T_base_laser;
  std::normal_distribution<double> noise(0, 0.01);
  Scan scan;
  scan.stamp = stamp;
  scan.angle_min = static_cast<float>(laser.angle_min);
  scan.angle_increment = static_cast<float>(laser.angle_increment);
  for (int i = 0; i < laser.beams; ++i) {
    const double angle = laser.angle_min + i * laser.angle_increment;
    const Eigen::Vector3d direction =
        T_map_laser.quaternion() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    const double range = range_in_hall(ground, walls, T_map_laser.translation(), direction);
    scan.ranges.push_back(static_cast<float>(range + noise(random)));
  }
  return scan;
}

struct RampErrors {
  double median = 0, largest = 0;  ///< m
};

/// There and back; with an inertial sensor that has a bias of 2 mrad, or without.
RampErrors errors_on(const Ground& ground, bool inertial, unsigned seed = 4) {
  const std::vector<test::Segment> walls = hall();
  RobotDescription robot = test::robot_with_laser();
  robot.laser->beam_interval = 0;
  robot.laser->T_base_laser = Transform<Base, Laser>::planar(0.2, 0, 0, kLaserHeight);
  robot.imu = ImuDescription{};
  auto slam = make_mapper(robot, {});
  EXPECT_TRUE(slam.ok());
  std::mt19937 random(seed);
  SensorTime stamp{1'700'000'000'000'000'000};
  Pose2 truth{3, 3.5, 0}, odom;
  const Pose2 start = truth;
  std::vector<double> errors;
  for (int i = 0; i < 360; ++i) {
    (*slam)->add(Odometry{stamp, transform<Odom, Base>(odom)});
    if (inertial) {
      ImuSample sample;
      sample.stamp = stamp;
      sample.orientation =
          Eigen::Quaterniond(Eigen::AngleAxisd(ground.pitch(truth.x) + 0.002, Eigen::Vector3d::UnitY()));
      (*slam)->add_inertial(sample);
    }
    const auto estimate = (*slam)->add(scan_on(ground, walls, *robot.laser, truth, stamp, random));
    EXPECT_TRUE(estimate);
    if (estimate) {
      const Pose2 expected = start.inverse() * truth;
      errors.push_back((planar(estimate->T_map_base).position() - expected.position()).norm());
    }
    // Wheels measure the way along the ramp.
    const double step = i < 180 ? 0.1 : -0.1;
    truth = truth * Pose2{step * std::cos(ground.pitch(truth.x)), 0, 0};
    odom = odom * Pose2{step, 0, 0};
    stamp = stamp + seconds(0.1);
  }
  RampErrors result;
  if (errors.empty()) return result;
  result.largest = *std::max_element(errors.begin(), errors.end());
  result.median = median(errors);
  return result;
}

RampErrors printed(const char* what, const RampErrors& errors) {
  std::printf("%s: error of position median %.3f, largest %.3f m\n", what, errors.median, errors.largest);
  return errors;
}

TEST(Ramp, PitchIsTakenOutOfScansOfARobotThatRocks) {
  const RampErrors with = printed("rocking by 18 degrees", errors_on(kRubble, true));
  const RampErrors without = printed("the same without inertial sensor", errors_on(kRubble, false));
  EXPECT_LT(with.median, 0.02);
  EXPECT_LT(with.largest, 0.16);
  EXPECT_GT(without.median, 10 * with.median) << "the drive does not show what is tested";
}

/// Before its foot a ramp looks like a wall that then retreats: this is what remains.
TEST(Ramp, AVisibleRampCostsLessThanWithoutTheInertialSensor) {
  const RampErrors with = printed("ramp of 18 degrees", errors_on(kRamp, true));
  const RampErrors without = printed("the same without inertial sensor", errors_on(kRamp, false));
  EXPECT_LT(with.largest, 0.22);
  EXPECT_GT(without.largest, 1.5 * with.largest);
}

/// Before the ramp's foot the map explains little; niches 1.4 m behind look alike.
TEST(Ramp, TheRobotIsNotFoundAgainWhereItCannotHaveDriven) {
  for (const unsigned seed : {11U, 15U, 21U}) {
    const RampErrors errors = printed("ramp of 18 degrees", errors_on(kRamp, true, seed));
    EXPECT_LT(errors.largest, 0.22) << "seed " << seed;
  }
}

TEST(Levelled, APitchedLaserSeesAWallAtItsLevelDistance) {
  RobotDescription robot = test::robot_with_laser();
  robot.laser->T_base_laser = Transform<Base, Laser>::planar(0, 0, 0, kLaserHeight);
  Scan scan;
  scan.angle_min = 0;
  scan.angle_increment = 0.01F;
  const double up = 0.2;
  scan.ranges = {static_cast<float>(5 / std::cos(up))};
  const auto level = deskewed(scan, *robot.laser, {}, Attitude{0, -up});
  ASSERT_EQ(level.points.size(), 1U);
  EXPECT_NEAR(level.points[0].x(), 5 - kLaserHeight * std::sin(up), 1e-4);
  EXPECT_NEAR(deskewed(scan, *robot.laser, {}).points[0].x(), 5 / std::cos(up), 1e-4);
  // Nose down, the same beam ends on the floor.
  EXPECT_TRUE(deskewed(scan, *robot.laser, {}, Attitude{0, up}).points.empty());
}

}  // namespace
}  // namespace parhelion::pose
