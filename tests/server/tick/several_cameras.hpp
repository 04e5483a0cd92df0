// A robot with a camera, and with a second camera that has a depth camera, in the synthetic room.
#pragma once

#include <string>

#include "protocols/channel_map.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::test {

inline const std::string kLeft = "left";
inline const std::string kLeftCamera = sensor_channel(channel::kCamera, kLeft);
inline const std::string kLeftDepth = sensor_channel(channel::kDepth, kLeft);

/// A camera that looks forwards, and to the left a camera with a depth camera.
inline RobotDescription robot_with_two_cameras() {
  RobotDescription description = robot_with_camera();
  NamedCameras left;
  left.name = kLeft;
  left.camera = description.camera;
  const Eigen::Quaterniond turned = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()) *
                                    Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  left.camera->T_base_optical = {turned, {0, 0.2, 0.8}};
  DepthCameraDescription& depth = left.depth.emplace();
  depth.intrinsics = left.camera->intrinsics;
  depth.T_base_optical = {turned, {0.05, 0.2, 0.8}};
  description.further_cameras = {left};
  return description;
}

/// A depth image of a wall 4 m away, which arrives 8 ms after its stamp.
inline Message left_depth_at(std::int64_t us) { return message(kLeftDepth, us + 8000, depth_of_a_wall(us)); }

inline Message left_image_at(std::int64_t us, std::int64_t stamp_off_us = 0) {
  Message left = image_at(us + stamp_off_us);
  left.channel = kLeftCamera;
  left.arrival = ArrivalTime::from_utime(us + 6000);
  return left;
}

}  // namespace parhelion::test
