// Depth frames of the 7-Scenes recordings as one cloud.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "fusion/cloud/sensor_cloud.hpp"
#include "tests/recordings.hpp"

namespace parhelion::test {

inline std::vector<std::string> kitchen_frames() {
  std::vector<std::string> frames;
  for (int i = 0; i < 200; i += 10) {
    char name[64];
    std::snprintf(name, sizeof(name), "rgbd-7scenes-redkitchen-a/frame-%06d", i);
    frames.emplace_back(name);
  }
  return frames;
}

/// Unit, in the world of the kitchen's poses.
inline Eigen::Vector3d kitchen_up() {
  std::ifstream file(recording("rgbd-7scenes-redkitchen-a/gravity-direction.txt"));
  Eigen::Vector3d down;
  file >> down.x() >> down.y() >> down.z();
  return -down.normalized();
}

inline std::vector<std::string> stairs_frames() {
  std::vector<std::string> frames;
  for (const char* sequence : {"seq-01", "seq-02", "seq-03", "seq-04"}) {
    for (const char* frame : {"0", "1", "2"})
      frames.push_back(std::string("rgbd-7scenes-stairs/") + sequence + "/frame-00000" + frame);
  }
  return frames;
}

/// Depth frames (paths without .depth.png) in the world of their poses.
inline cloud::PointCloud<Cloud> fused(const std::vector<std::string>& frames) {
  CameraIntrinsics camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 585;
  camera.cx = 320;
  camera.cy = 240;
  cloud::PointCloud<Cloud> all;
  for (const std::string& frame : frames) {
    const cv::Mat depth = cv::imread(recording(frame + ".depth.png").string(), cv::IMREAD_UNCHANGED);
    EXPECT_EQ(depth.type(), CV_16U) << frame;
    std::ifstream pose(recording(frame + ".pose.txt"));
    Eigen::Matrix4d matrix;
    for (int i = 0; i < 16; ++i) pose >> matrix(i / 4, i % 4);
    cloud::DepthCloudOptions options;
    options.step = 2;
    options.range_max = 4;
    const auto one = cloud::cloud_from_depth({depth.ptr<std::uint16_t>(), depth.total()}, camera, options);
    EXPECT_TRUE(one.ok());
    const Transform<Cloud, DepthOptical> T_cloud_optical(Eigen::Quaterniond(matrix.topLeftCorner<3, 3>()),
                                                         matrix.topRightCorner<3, 1>());
    const auto moved = cloud::transformed(T_cloud_optical, *one);
    all.points.insert(all.points.end(), moved.points.begin(), moved.points.end());
    all.scans.insert(all.scans.end(), moved.size(), static_cast<std::uint16_t>(all.viewpoints.size()));
    all.viewpoints.push_back(T_cloud_optical.translation());
  }
  return all;
}

}  // namespace parhelion::test
