// Camera and depth images of a log with their poses, for `map texture`.
#include "tools/map/image_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "protocols/model.hpp"
#include "protocols/site_texture.hpp"
#include "tests/fusion/semantic/painted_room.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"
#include "tests/tools/robot_log.hpp"

namespace parhelion::tools {
namespace {

using test::PaintedRoom;
using test::RobotLog;
using test::TemporaryFolder;

RobotDescription robot_with_cameras() {
  RobotDescription robot;
  robot.name = "scout";
  robot.footprint = {{-0.2, -0.2}, {0.2, -0.2}, {0.2, 0.2}, {-0.2, 0.2}};
  robot.height = 0.4;
  const semantic::Pinhole c = PaintedRoom::camera();
  CameraIntrinsics intrinsics;
  intrinsics.width = c.width, intrinsics.height = c.height;
  intrinsics.fx = c.fx, intrinsics.fy = c.fy, intrinsics.cx = c.cx, intrinsics.cy = c.cy;
  robot.camera.emplace().intrinsics = intrinsics;
  robot.depth.emplace().intrinsics = intrinsics;
  return robot;
}

Image colour_image(const semantic::ColourView& view, SensorTime stamp) {
  Image image;
  image.stamp = stamp;
  image.width = view.camera.width, image.height = view.camera.height;
  image.row_stride = 3 * image.width;
  image.format = PixelFormat::rgb;
  image.bytes = view.rgb;
  return image;
}

Image depth_image(const semantic::DepthView& view, SensorTime stamp) {
  Image image;
  image.stamp = stamp;
  image.width = view.camera.width, image.height = view.camera.height;
  image.row_stride = 2 * image.width;
  image.format = PixelFormat::depth_mm;
  image.metadata.push_back({"encoding", {'r', 'a', 'w'}});
  for (const std::uint16_t mm : view.millimetres) {
    image.bytes.push_back(static_cast<std::uint8_t>(mm & 255));
    image.bytes.push_back(static_cast<std::uint8_t>(mm >> 8));
  }
  return image;
}

SensorTime at(int index) { return SensorTime::from_utime(2'000'000 + 100'000 * index); }

/// The base is the camera here.
PoseStamped pose_of(const Transform<Map, CameraOptical>& T, SensorTime stamp) {
  PoseStamped pose;
  pose.stamp = stamp;
  pose.T_map_base = T.as<Map, Base>();
  return pose;
}

void record(RobotLog& log, const std::vector<Transform<Map, CameraOptical>>& poses, bool with_depth = true) {
  std::mt19937 random(3);
  for (int i = 0; i < static_cast<int>(poses.size()); ++i) {
    const auto& pose = poses[static_cast<std::size_t>(i)];
    log.write("POSE", pose_of(pose, at(i)));
    log.write("CAMERA", colour_image(PaintedRoom::colour(pose), at(i)));
    if (with_depth) log.write("DEPTH", depth_image(PaintedRoom::depth(pose, random), at(i)));
  }
}

TEST(ImageFrames, HaveThePosesOfTheirCamerasAndTheirPixels) {
  const TemporaryFolder folder;
  const auto poses = PaintedRoom::round(6);
  RobotLog log(folder / "drive.lcm", robot_with_cameras());
  record(log, poses);
  const auto frames = read_image_frames(folder / "drive.lcm");
  ASSERT_TRUE(frames) << frames.error().message;
  ASSERT_EQ(frames->colour.size(), 6U);
  ASSERT_EQ(frames->depth.size(), 6U) << testing::PrintToString(frames->notes);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_TRUE(frames->colour[i].T_map_optical.isometry().isApprox(poses[i].isometry(), 1e-9));
    EXPECT_EQ(frames->colour[i].rgb, PaintedRoom::colour(poses[i]).rgb);
    EXPECT_EQ(frames->depth[i].millimetres.size(), PaintedRoom::camera().pixels());
  }
}

TEST(ImageFrames, AreFromNewPlacesOnlyAndOfTheWantedOnes) {
  const TemporaryFolder folder;
  auto poses = PaintedRoom::round(6);
  poses.insert(poses.begin() + 1, poses[0]);
  RobotLog log(folder / "drive.lcm", robot_with_cameras());
  record(log, poses);
  EXPECT_EQ(read_image_frames(folder / "drive.lcm")->colour.size(), 6U);
  ImageFrameOptions few;
  few.max_images = 2;
  const auto two = read_image_frames(folder / "drive.lcm", few);
  ASSERT_TRUE(two.ok());
  EXPECT_LE(two->colour.size(), 2U);
  ImageFrameOptions some;
  some.wanted = [&](const Eigen::Isometry3d& T) {
    return (T.translation() - poses[0].translation()).norm() > 0.5;
  };
  EXPECT_LT(read_image_frames(folder / "drive.lcm", some)->colour.size(), 6U);
}

TEST(ImageFrames, WhatCannotBeUsedIsLeftOutWithAWord) {
  const TemporaryFolder folder;
  const auto poses = PaintedRoom::round(3);
  RobotLog log(folder / "drive.lcm", robot_with_cameras());
  record(log, poses);
  log.write("POSE", pose_of(Transform<Map, CameraOptical>(Eigen::Quaterniond::Identity(),
                                                          {std::numeric_limits<double>::quiet_NaN(), 0, 0}),
                            at(4)));
  Image tiny = colour_image(PaintedRoom::colour(poses[1]), at(1));
  tiny.stamp = at(1) + microseconds(50'000);  // between two poses
  tiny.width = tiny.height = 1, tiny.row_stride = 3;
  tiny.bytes.resize(3);
  log.write("CAMERA", tiny);
  log.write("CAMERA", colour_image(PaintedRoom::colour(poses[0]), at(400)));
  const auto frames = read_image_frames(folder / "drive.lcm");
  ASSERT_TRUE(frames) << frames.error().message;
  EXPECT_EQ(frames->colour.size(), 3U);
  std::string notes;
  for (const std::string& note : frames->notes) notes += note + "\n";
  EXPECT_NE(notes.find("no pose"), std::string::npos) << notes;
  EXPECT_NE(notes.find("1x1"), std::string::npos) << notes;
}

TEST(ImageFrames, ALogThatCannotGiveATextureIsRefusedWithTheReason) {
  const TemporaryFolder folder;
  const auto fails = [&](const std::string& word, const ImageFrameOptions& options = {}) {
    const auto frames = read_image_frames(folder / "drive.lcm", options);
    ASSERT_FALSE(frames.ok()) << word;
    EXPECT_NE(frames.error().message.find(word), std::string::npos) << frames.error().message;
    EXPECT_NE(frames.error().message.find("drive.lcm"), std::string::npos) << frames.error().message;
  };
  fails("drive.lcm");
  const auto poses = PaintedRoom::round(2);
  { RobotLog(folder / "drive.lcm", robot_with_cameras()); }
  fails("has no poses");
  {
    RobotLog log(folder / "drive.lcm", robot_with_cameras());
    log.write("POSE", pose_of(poses[0], at(0)));
  }
  fails("has no CAMERA image");
  {
    RobotDescription blind = robot_with_cameras();
    blind.camera.reset();
    RobotLog log(folder / "drive.lcm", blind);
    log.write("POSE", pose_of(poses[0], at(0)));
  }
  fails("no camera");
  {
    RobotLog log(folder / "drive.lcm", robot_with_cameras());
    log.write("POSE", pose_of(poses[0], at(0)));
    log.write("CAMERA", colour_image(PaintedRoom::colour(poses[0]), at(50)));
  }
  fails("has a pose at its time");
}

TEST(MapTexture, WritesATextureBesideTheModelAndNeverOverOne) {
  const TemporaryFolder folder;
  RobotLog log(folder / "drive.lcm", robot_with_cameras());
  record(log, PaintedRoom::round(8));
  std::ofstream(folder / "room.yaml") << to_yaml(PaintedRoom::model());
  const std::vector<std::string> words = {
      "map", "texture", folder / "room.yaml", "--log", folder / "drive.lcm", "--voxel", "0.05"};
  const auto made = test::run(words, folder / "words.txt");
  ASSERT_EQ(made.exit, 0) << made.output;
  EXPECT_NE(made.output.find("seen by a camera"), std::string::npos) << made.output;
  const auto texture = load_texture_of(folder / "room.yaml", "");
  ASSERT_TRUE(texture) << texture.error().message;
  ASSERT_NE(*texture, nullptr);
  EXPECT_GT((*texture)->quads.size(), 3000U);
  const auto again = test::run(words, folder / "words.txt");
  EXPECT_EQ(again.exit, 1);
  EXPECT_NE(again.output.find("exists"), std::string::npos) << again.output;
}

TEST(MapTexture, ReportsWhoWasLeftOutAndWhatIsWrongWithTheLens) {
  const TemporaryFolder folder;
  RobotDescription robot = robot_with_cameras();
  robot.camera->intrinsics.fx *= 1.12, robot.camera->intrinsics.fy *= 1.12;
  RobotLog log(folder / "drive.lcm", robot);
  const auto poses = PaintedRoom::round(24);
  std::mt19937 random(3);
  for (int i = 0; i < static_cast<int>(poses.size()); ++i) {
    const auto& pose = poses[static_cast<std::size_t>(i)];
    const Eigen::Vector2d walker(0.6 + 2.8 * std::abs(std::fmod(0.25 * i, 2.0) - 1), 0.7);
    log.write("POSE", pose_of(pose, at(i)));
    log.write("CAMERA", colour_image(PaintedRoom::colour(pose, 1, &walker), at(i)));
    log.write("DEPTH", depth_image(PaintedRoom::depth(pose, random, &walker), at(i)));
  }
  std::ofstream(folder / "room.yaml") << to_yaml(SemanticModel{});
  const auto made =
      test::run({"map", "texture", folder / "room.yaml", "--log", folder / "drive.lcm", "--voxel", "0.04"},
                folder / "words.txt");
  ASSERT_EQ(made.exit, 0) << made.output;
  EXPECT_NE(made.output.find("moved were left out of"), std::string::npos) << made.output;
  EXPECT_NE(made.output.find("fx and fy times 0.8"), std::string::npos) << made.output;
}

}  // namespace
}  // namespace parhelion::tools
