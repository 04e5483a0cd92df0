// Height and tilt of a laser, by depth images of generated rooms.
#include "tools/calibration/laser_level.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "tests/tools/calibration/level_room.hpp"
#include "tools/calibration/calibration_level.hpp"

namespace parhelion::tools {
namespace {

using test::LevelTruth;
using test::RoomStyle;

constexpr double kLevelDegree = std::numbers::pi / 180;
constexpr int kLevelImages = 70;

Result<LaserLevel> fitted_level(std::uint32_t seed, RoomStyle style, const LevelTruth& truth) {
  LaserLevelFit fit(test::level_robot(truth));
  test::drive_level(seed, style, truth, fit, kLevelImages);
  return fit.fit();
}

/// 1: it is shown.
int expect_level(const pose::Measured& found, double truth, const char* name) {
  if (!found.shown) return 0;
  EXPECT_LE(std::abs(found.value - truth), 3 * found.sigma) << name;
  return 1;
}

RobotDescription tilted_robot(const LevelTruth& truth) {
  RobotDescription robot = test::level_robot(truth);
  Eigen::Isometry3d T_base_laser = robot.laser->T_base_laser.isometry();
  T_base_laser.linear() =
      test::level_pose(0, 0, 0, truth.laser_pitch, truth.laser_roll, 0).linear() * T_base_laser.linear();
  robot.laser->T_base_laser = Transform<Base, Laser>(T_base_laser);
  return robot;
}

TEST(LaserLevel, IsWithinItsSigmaInRoomsOfAllStyles) {
  int heights = 0, tilts = 0;
  for (const auto& [style, seed] : {std::pair{RoomStyle::boxes, 31U},
                                    {RoomStyle::boxes, 32U},
                                    {RoomStyle::office, 31U},
                                    {RoomStyle::warehouse, 31U}}) {
    SCOPED_TRACE(static_cast<int>(style));
    SCOPED_TRACE(seed);
    const LevelTruth truth = test::random_truth(seed);
    const auto level = fitted_level(seed, style, truth);
    ASSERT_TRUE(level.ok()) << level.error().message;
    heights += expect_level(level->height, truth.laser_height, "height");
    tilts += expect_level(level->pitch, truth.laser_pitch, "pitch") +
             expect_level(level->roll, truth.laser_roll, "roll");
    ASSERT_TRUE(level->camera.has_value());
    EXPECT_NEAR(level->camera->height, truth.camera_higher, 0.01);
    EXPECT_NEAR(level->camera->pitch, truth.camera_pitch_more, 0.3 * kLevelDegree);
    const auto laser = with_level(test::level_robot(truth), *level).laser->T_base_laser;
    EXPECT_EQ(laser.translation().z(), level->height.value);
  }
  EXPECT_GE(heights, 2);
  EXPECT_GE(tilts, 3);
}

TEST(LaserLevel, FindsNoMoreTiltThanDescribed) {
  int shown = 0;
  for (const std::uint32_t seed : {31U, 32U}) {
    LevelTruth truth = test::random_truth(seed);
    truth.laser_pitch = 3 * kLevelDegree;
    truth.laser_roll = -2.5 * kLevelDegree;
    const RobotDescription described = tilted_robot(truth);
    LaserLevelFit fit(described);
    test::drive_level(seed, RoomStyle::boxes, truth, fit, kLevelImages);
    const auto level = fit.fit();
    ASSERT_TRUE(level.ok()) << level.error().message;
    for (const pose::Measured& found : {level->pitch, level->roll}) {
      if (!found.shown) continue;
      ++shown;
      EXPECT_LE(std::abs(found.value), 2 * found.sigma);
    }
    const auto& written = with_level(described, *level).laser->T_base_laser;
    EXPECT_LT(written.quaternion().angularDistance(described.laser->T_base_laser.quaternion()),
              0.6 * kLevelDegree);
  }
  EXPECT_GE(shown, 2);
}

TEST(LaserLevel, KeepsTheYawAndTurnsByTheTilt) {
  for (const double yaw : {0.0, 90.0, -135.0}) {
    LevelTruth truth;
    truth.laser_pitch = 3 * kLevelDegree;
    truth.laser_roll = 3 * kLevelDegree;
    RobotDescription robot = test::level_robot(truth);
    robot.laser->T_base_laser =
        Transform<Base, Laser>(test::level_pose(0.2, 0, 0.25, 0, 0, yaw * kLevelDegree));
    LaserLevel level;
    level.pitch = {truth.laser_pitch, 0.002, true};
    level.roll = {truth.laser_roll, 0.002, true};
    EXPECT_EQ(to_yaml(with_level(robot, level)), to_yaml(robot)) << "not to be written";
    level.writes_pitch = level.writes_roll = true;
    const Transform<Base, Laser> after = with_level(robot, level).laser->T_base_laser;
    EXPECT_NEAR(wrap_angle(after.yaw() - yaw * kLevelDegree), 0, 1e-12);
    const Eigen::Vector3d up = after.isometry().linear().col(2);
    const Eigen::Vector3d tilted =
        test::level_pose(0, 0, 0, truth.laser_pitch, truth.laser_roll, 0).linear().col(2);
    EXPECT_LT(std::acos(std::min(1.0, up.dot(tilted))), 0.2 * kLevelDegree);
  }
}

TEST(LaserLevel, IsNotShownAtTheEdgeOfWhatIsLookedAt) {
  LevelTruth truth = test::random_truth(31);
  truth.laser_pitch = 6 * kLevelDegree;
  truth.laser_roll = 0;
  const auto level = fitted_level(31, RoomStyle::boxes, truth);
  ASSERT_TRUE(level.ok()) << level.error().message;
  EXPECT_FALSE(level->pitch.shown) << level->pitch.value << " +- " << level->pitch.sigma;
}

TEST(LaserLevel, IsNotShownByACameraThatSeesNoFloor) {
  LevelTruth truth = test::random_truth(31);
  truth.laser_height = 0.45;
  truth.camera_height = 0.9;
  truth.camera_down = -0.25;
  const auto level = fitted_level(31, RoomStyle::boxes, truth);
  ASSERT_TRUE(level.ok()) << level.error().message;
  EXPECT_FALSE(level->camera);
  EXPECT_FALSE(level->height.shown || level->pitch.shown || level->roll.shown);
  EXPECT_THAT(level->advice, testing::Contains(testing::HasSubstr("sees no floor")));
}

TEST(LaserLevel, IsTheSameWithTheLensOfALargerImage) {
  const LevelTruth truth = test::random_truth(31);
  RobotDescription robot = test::level_robot(truth);
  CameraIntrinsics& lens = robot.depth->intrinsics;
  lens.width *= 2, lens.height *= 2, lens.fx *= 2, lens.fy *= 2;
  lens.cx = 2 * lens.cx + 0.5, lens.cy = 2 * lens.cy + 0.5;
  LaserLevelFit scaled(robot);
  test::drive_level(31, RoomStyle::boxes, truth, scaled, 20);
  LaserLevelFit same(test::level_robot(truth));
  test::drive_level(31, RoomStyle::boxes, truth, same, 20);
  const auto level = scaled.fit(), wanted = same.fit();
  ASSERT_TRUE(level.ok() && wanted.ok());
  EXPECT_EQ(level->beams, wanted->beams);
  EXPECT_NEAR(level->agreeing, wanted->agreeing, 1e-6);
  EXPECT_EQ(scaled.left_out(), 0U);
  lens.height *= 2;
  LaserLevelFit other(robot);
  test::drive_level(31, RoomStyle::boxes, truth, other, 20);
  EXPECT_EQ(other.left_out(), 20U);
  EXPECT_FALSE(other.fit().ok());
}

TEST(LaserLevel, CountsHitsBelowTheFloor) {
  LevelTruth truth;
  truth.laser_pitch = 3 * kLevelDegree;
  Scan scan;
  scan.angle_min = 0;
  scan.angle_increment = 0.001F;
  scan.ranges = {2, 3, 4, 6, 10, 19, 18, 17};  // m; the beams reach the floor at 4.8
  EXPECT_EQ(below_floor(scan, *test::level_robot(truth).laser), 0);
  EXPECT_EQ(below_floor(scan, *tilted_robot(truth).laser), 5.0 / 8);
  LaserLevel level;
  level.pitch = {truth.laser_pitch, 0.002, true};
  level.writes_pitch = true;
  RecordedDrive drive;
  drive.scans = {scan};
  drive.events = {{RecordedDrive::Event::Kind::scan, 0}};
  LaserLevel refused = level;
  keep_above_floor(drive, test::level_robot(truth), refused);
  EXPECT_FALSE(refused.writes_pitch);
  EXPECT_THAT(refused.advice, testing::Contains(testing::HasSubstr("below the floor")));
  drive.scans[0].ranges = {2, 3, 4, 2, 3, 4};
  keep_above_floor(drive, test::level_robot(truth), level);
  EXPECT_TRUE(level.writes_pitch);
}

TEST(LaserLevel, IsTheSameWhicheverHeightIsDescribed) {
  const LevelTruth truth = test::random_truth(33);
  RobotDescription robot = test::level_robot(truth);
  Eigen::Isometry3d T_base_laser = robot.laser->T_base_laser.isometry();
  T_base_laser.translation().z() = 0.9;
  robot.laser->T_base_laser = Transform<Base, Laser>(T_base_laser);
  LaserLevelFit other(robot);
  test::drive_level(33, RoomStyle::boxes, truth, other, kLevelImages);
  const auto level = fitted_level(33, RoomStyle::boxes, truth), again = other.fit();
  ASSERT_TRUE(level.ok() && again.ok());
  ASSERT_TRUE(level->height.shown);
  EXPECT_EQ(again->height.value, level->height.value);
  EXPECT_EQ(again->height.sigma, level->height.sigma);
}

TEST(LaserLevel, IsNotShownInAnEmptyHall) {
  const LevelTruth truth = test::random_truth(34);
  const auto level = fitted_level(34, RoomStyle::empty_hall, truth);
  ASSERT_TRUE(level.ok()) << level.error().message;
  EXPECT_FALSE(level->height.shown);
  EXPECT_THAT(level->advice, testing::Contains(testing::HasSubstr("drive past tables")));
  const RobotDescription before = test::level_robot(truth);
  EXPECT_EQ(with_level(before, *level).laser->T_base_laser.translation().z(), 0.25);
}

TEST(LaserLevel, IsRefusedWhereImagesAreOfAnotherPlace) {
  const LevelTruth truth = test::random_truth(36);
  RobotDescription turned = test::level_robot(truth);
  turned.depth->T_base_optical = Transform<Base, DepthOptical>(
      test::level_pose(0, 0, 0, 0, 0, 35 * kLevelDegree) * turned.depth->T_base_optical.isometry());
  LaserLevelFit wrong(turned);
  test::drive_level(36, RoomStyle::boxes, truth, wrong, kLevelImages);
  const auto level = wrong.fit();
  ASSERT_FALSE(level.ok());
  EXPECT_THAT(level.error().message, testing::HasSubstr("is the camera where the description has it"));
}

}  // namespace
}  // namespace parhelion::tools
