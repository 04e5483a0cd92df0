// Height and tilt of a laser, by depth images of generated rooms.
#include "tools/calibration/laser_level.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "tests/tools/calibration/level_room.hpp"

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

void expect_level(const pose::Measured& found, double truth, const char* name) {
  if (!found.shown) return;
  EXPECT_LE(std::abs(found.value - truth), 3 * found.sigma) << name;
}

TEST(LaserLevel, IsWithinItsSigmaInRoomsOfAllStyles) {
  int shown = 0;
  for (const auto& [style, seed] : {std::pair{RoomStyle::boxes, 31U},
                                    {RoomStyle::boxes, 32U},
                                    {RoomStyle::office, 31U},
                                    {RoomStyle::warehouse, 31U}}) {
    SCOPED_TRACE(static_cast<int>(style));
    SCOPED_TRACE(seed);
    const LevelTruth truth = test::random_truth(seed);
    const auto level = fitted_level(seed, style, truth);
    ASSERT_TRUE(level.ok()) << level.error().message;
    shown += level->height.shown ? 1 : 0;
    expect_level(level->height, truth.laser_height, "height");
    expect_level(level->pitch, truth.laser_pitch, "pitch");
    expect_level(level->roll, truth.laser_roll, "roll");
    ASSERT_TRUE(level->camera.has_value());
    EXPECT_NEAR(level->camera->height, truth.camera_higher, 0.01);
    EXPECT_NEAR(level->camera->pitch, truth.camera_pitch_more, 0.3 * kLevelDegree);
    const auto laser = with_level(test::level_robot(truth), *level).laser->T_base_laser;
    EXPECT_EQ(laser.translation().z(), level->height.value);
  }
  EXPECT_GE(shown, 2);
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
