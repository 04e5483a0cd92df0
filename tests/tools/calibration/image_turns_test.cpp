// Turns between images of a camera that drives through a room, and the time offset of its stamps.
#include "tools/calibration/image_turns.hpp"

#include <gtest/gtest.h>

#include "fusion/pose/calibration/turn_calibration.hpp"
#include "tests/fusion/pose/calibration_drive.hpp"
#include "tests/tools/calibration/textured_room.hpp"

namespace parhelion::tools {
namespace {

constexpr double kRate = 12;  ///< Hz, of images

/// Images along the path; stamps without an offset, with some jitter.
std::vector<pose::Turn> turns_along(const test::SampledPath& path, double jitter, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  auto turns = ImageTurns::create(test::level_camera(0.3));
  EXPECT_TRUE(turns.ok());
  for (double t = 0.02; t < path.duration() - 0.02; t += 1 / kRate) {
    const SensorTime stamp = SensorTime{} + seconds(1000 + t + jitter * noise(random));
    turns->add(test::textured_image(test::level_camera(0.3), path.at(t), stamp, random));
  }
  EXPECT_EQ(turns->counts().refused, 0U);
  EXPECT_LT(turns->counts().unmatched, turns->counts().images / 10);
  return turns->turns();
}

Result<pose::TurnCalibration> calibrated(const test::SampledPath& path, std::vector<pose::Turn> turns,
                                         double time_offset, std::uint32_t seed) {
  for (pose::Turn& turn : turns) {
    turn.from = turn.from - seconds(time_offset);
    turn.to = turn.to - seconds(time_offset);
  }
  std::mt19937 random(seed);
  return pose::calibrate_turns(test::laser_poses_of(path, test::DriveErrors(), random), pose::TurnPath(turns),
                               {"camera", 0, false});
}

TEST(ImageTurns, AreThoseOfTheBase) {
  std::mt19937 random(1);
  auto turns = ImageTurns::create(test::level_camera(-0.4));
  ASSERT_TRUE(turns.ok());
  const double yaws[] = {0, 0.02, 0.13, 0.05, -0.12, -0.12};
  for (int i = 0; i < 6; ++i) {
    // Turned about the camera, which stands still; the base is beside it.
    const Pose2 T_map_camera{6.3, 1.3, yaws[i]}, T_base_camera{0.2, 0.05, 0};
    turns->add(test::textured_image(test::level_camera(-0.4), T_map_camera * T_base_camera.inverse(),
                                    SensorTime{} + seconds(10 + 0.1 * i), random));
  }
  ASSERT_EQ(turns->turns().size(), 5U);
  for (int i = 0; i < 5; ++i)
    EXPECT_NEAR(turns->turns()[static_cast<std::size_t>(i)].angle, yaws[i + 1] - yaws[i], 0.0005) << i;
}

TEST(ImageTurns, ShowTheOffsetOfTheStampsWithinThreeSigma) {
  const test::SampledPath path = test::brisk_path(1);
  const std::vector<pose::Turn> turns = turns_along(path, 0.002, 3);
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const double offset = 0.09 * seed - 0.31;
    SCOPED_TRACE(offset);
    const auto found = calibrated(path, turns, offset, seed);
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_TRUE(found->time_offset.shown) << found->time_offset.sigma;
    EXPECT_LT(found->time_offset.sigma, 0.005);
    EXPECT_LE(std::abs(found->time_offset.value - offset), 3 * found->time_offset.sigma)
        << found->time_offset.value << " +- " << found->time_offset.sigma;
    EXPECT_TRUE(found->advice.empty());
  }
}

TEST(ImageTurns, DoNotShowTheOffsetWhereTheRobotDrivesStraight) {
  test::SampledPath path;
  Pose2 pose{3.0, 1.4, 0};
  for (int i = 0; i < 2400; ++i) {
    path.poses.push_back(pose);
    pose = pose * moved({0.4, 0, 0}, test::SampledPath::kStep);
  }
  const auto found = calibrated(path, turns_along(path, 0.002, 4), 0.1, 1);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_FALSE(found->time_offset.shown) << found->time_offset.value << " +- " << found->time_offset.sigma;
  EXPECT_EQ(found->time_offset.value, 0);
  EXPECT_EQ(found->advice.size(), 1U);
}

TEST(ImageTurns, RefuseWhatTheyCannotUse) {
  CameraDescription camera = test::level_camera(0);
  camera.head.push_back({"pan", {0, 0, 0.5}, Eigen::Vector3d::UnitZ()});
  EXPECT_FALSE(ImageTurns::create(camera).ok());
  std::mt19937 random(1);
  auto turns = ImageTurns::create(test::level_camera(0));
  ASSERT_TRUE(turns.ok());
  const Pose2 pose{6, 1.3, 0};
  Image image = test::textured_image(test::level_camera(0), pose, SensorTime{} + seconds(1), random);
  turns->add(image);
  turns->add(image);  // the same stamp
  image.stamp = image.stamp + milliseconds(50);
  image.bytes.resize(100);
  turns->add(image);
  image.format = PixelFormat::mjpeg;
  turns->add(image);
  EXPECT_EQ(turns->counts().refused, 3U);
  Image dark = test::textured_image(test::level_camera(0), pose, SensorTime{} + seconds(1.2), random);
  std::fill(dark.bytes.begin(), dark.bytes.end(), std::uint8_t{9});
  turns->add(dark);
  EXPECT_EQ(turns->counts().unmatched, 1U);
  EXPECT_TRUE(turns->turns().empty());
}

}  // namespace
}  // namespace parhelion::tools
