#include "tests/fusion/pose/true_drive.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "fusion/pose/slam.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::pose {
namespace {

using test::TrueDrive;
using test::TrueDriveOptions;

double odometry_time(const Odometry& odometry) {
  return (odometry.stamp - SensorTime{TrueDrive::kStart}).seconds();
}

TEST(TrueDrive, HasOdometryThatIsLateByWhatWasAsked) {
  TrueDriveOptions options;
  options.odometry_noise = 0;
  options.odometry_scale = 1;
  const TrueDrive drive = test::true_drive(test::office(3), test::robot_with_laser(), options);
  const Pose2 start = drive.path.at(0);
  double late = 0, early = 1;
  for (const Odometry& odometry : drive.odometry) {
    // The instant of the truth that it equals, among those that the jitter allows.
    const Pose2 by_odometry = start * planar(odometry.T_odom_base);
    const double t = odometry_time(odometry);
    double nearest = 1, at = 0;
    for (double delay = 0.07; delay < 0.1301; delay += 0.001) {
      const double off = (drive.path.at(t - delay).position() - by_odometry.position()).norm();
      if (off < nearest) nearest = off, at = delay;
    }
    ASSERT_LT(nearest, 0.002);
    if (drive.path.twist_at(t - at).vx < 0.5) continue;
    late = std::max(late, at);
    early = std::min(early, at);
  }
  EXPECT_NEAR(early, 0.08, 0.003);
  EXPECT_NEAR(late, 0.12, 0.003);
  for (std::size_t i = 1; i < drive.odometry.size(); ++i)
    EXPECT_GT(drive.odometry[i].stamp, drive.odometry[i - 1].stamp);
}

TEST(TrueDrive, HasOdometryOfTheScaleThatWasAsked) {
  TrueDriveOptions options;
  options.odometry_noise = 0;
  const test::TrueBuilding straight = test::long_corridor();
  const TrueDrive drive = test::true_drive(straight, test::robot_with_laser(), options);
  const double driven = (drive.path.at(1e9).position() - drive.path.at(0).position()).norm();
  EXPECT_NEAR(drive.odometry.back().T_odom_base.translation().norm() / driven, 1.02, 0.003);
}

/// Fraction of returns that lie within 4 cm of a wall.
double on_walls(const TrueDrive& drive, const std::vector<test::Segment>& walls) {
  std::size_t hits = 0, on = 0;
  for (std::size_t s = 0; s < drive.scans.size(); s += 20) {
    const test::TrueScan& at = drive.scans[s];
    const LaserDescription& laser = *drive.robot.laser;
    for (std::size_t i = 0; i < at.scan.ranges.size(); ++i) {
      if (laser.convention.classify(at.scan.ranges[i]) != BeamKind::hit) continue;
      const double dt = laser.beam_time(i, at.scan.ranges.size()).seconds();
      const Pose2 T_map_laser = at.T_map_base * moved(at.twist, dt) * planar(laser.T_base_laser);
      const double angle = T_map_laser.yaw + laser.angle_min + static_cast<double>(i) * laser.angle_increment;
      const double wall = test::cast(walls, T_map_laser.position(), angle);
      ++hits;
      if (std::abs(wall - static_cast<double>(at.scan.ranges[i])) < 0.04) ++on;
    }
  }
  return static_cast<double>(on) / static_cast<double>(hits);
}

TEST(TrueDrive, SeesTheWallsFromItsTruePoses) {
  const test::TrueBuilding building = test::office(3);
  const TrueDrive drive = test::true_drive(building, test::robot_with_laser(), {});
  EXPECT_GT(on_walls(drive, building.now), 0.99);
}

TEST(TrueDrive, SeesPeopleAndMovedFurniture) {
  const test::TrueBuilding building = test::office(3, 0.5);
  EXPECT_EQ(building.mapped.size(), building.now.size());
  TrueDriveOptions options;
  options.people = 4;
  const TrueDrive drive = test::true_drive(building, test::robot_with_laser(), options);
  const double now = on_walls(drive, building.now), mapped = on_walls(drive, building.mapped);
  EXPECT_LT(now, 0.97);
  EXPECT_GT(now, 0.5);
  EXPECT_LT(mapped, now - 0.02);
}

TEST(TrueDrive, IsTheSameForTheSameSeed) {
  TrueDriveOptions options;
  options.people = 2;
  const auto once = test::true_drive(test::office(8), test::robot_with_laser(), options);
  const auto again = test::true_drive(test::office(8), test::robot_with_laser(), options);
  options.seed = 2;
  const auto other = test::true_drive(test::office(8), test::robot_with_laser(), options);
  ASSERT_EQ(once.scans.size(), again.scans.size());
  EXPECT_EQ(once.scans.back().scan.ranges, again.scans.back().scan.ranges);
  EXPECT_NE(once.scans.back().scan.ranges, other.scans.back().scan.ranges);
}

TEST(TrueDrive, CanBeLocalizedInItsTrueMap) {
  const test::TrueBuilding building = test::office(5);
  const RobotDescription robot = test::robot_with_laser();
  const TrueDrive drive = test::true_drive(building, robot, {});
  const test::TemporaryFolder folder;
  const std::string path = folder / "map.simplemap";
  ASSERT_TRUE(write_simplemap(test::true_map(building, robot), path).ok());
  SlamOptions options;
  const Pose2 start = drive.path.at(0);
  options.start = Eigen::Vector3d(start.x, start.y, start.yaw);
  auto localizer = make_localizer(robot, path, options);
  ASSERT_TRUE(localizer.ok()) << localizer.error().message;
  std::vector<double> errors;
  auto odometry = drive.odometry.begin();
  for (const test::TrueScan& at : drive.scans) {
    for (; odometry != drive.odometry.end() && odometry->stamp <= at.scan.stamp; ++odometry)
      (*localizer)->add(*odometry);
    const auto estimate = (*localizer)->add(at.scan);
    if (estimate && estimate->state == SlamState::tracking)
      errors.push_back((planar(estimate->T_map_base).position() - at.T_map_base.position()).norm());
  }
  ASSERT_GT(errors.size(), drive.scans.size() * 9 / 10);
  std::nth_element(errors.begin(), errors.begin() + static_cast<long>(errors.size() / 2), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.03);
}

}  // namespace
}  // namespace parhelion::pose
