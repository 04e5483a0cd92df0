// A recorded drive for `parhelion calibrate` whose errors are known.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <random>
#include <vector>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "tests/fusion/pose/calibration_drive.hpp"
#include "tests/tools/calibration/hanging_room.hpp"
#include "tests/tools/calibration/textured_room.hpp"

namespace parhelion::test {

inline constexpr double kImuOffset = 0.035, kImuBias = -0.01, kImuScale = 0.99, kCameraOffset = -0.06;

/// Of the scans: how long a sweep lasts, s, and whether messages hold its beams in reverse order, which the
/// description does not say.
struct Sweep {
  double duration = 26.7e-3;
  bool reversed = false;
};

/// What is wrong with the messages of a drive; called for each in the order of their instants, at `t` s.
struct Fault {
  std::function<void(double t, Odometry&)> of_odometry = [](double, Odometry&) {};
  std::function<void(double t, Scan&)> of_scans = [](double, Scan&) {};
};

class LoggedDrive {
 public:
  LoggedDrive(std::uint32_t seed, const DriveErrors& errors, bool camera, const Fault& fault = {},
              double rounds = 1.5, const Sweep& sweep = {})
      : random_(seed), errors_(errors), path_(brisk_path(rounds)) {
    robot_ = robot_with_laser();  // the drawing
    robot_.laser->beam_interval = sweep.duration / robot_.laser->beams;
    robot_.imu = ImuDescription{};
    if (camera) robot_.camera = level_camera(0);
    RobotDescription real = pose::with_motion_parameters(robot_, {{}, errors_.T_base_laser, {}, 0});
    if (sweep.reversed) real.laser->beam_interval = -real.laser->beam_interval;
    RobotMessage description;
    description.yaml = to_yaml(robot_);
    put(-1, channel::kRobot, description);
    for (Odometry odometry : odometry_of(path_, errors_, random_)) {
      const double t = (odometry.stamp - SensorTime{}).seconds() - 1000;
      fault.of_odometry(t, odometry);
      put(t, channel::kOdometry, odometry);
    }
    // Each message arrives when it was taken; only stamps differ.
    for (double t = 0.05; t < path_.duration() - 0.1; t += 0.1) {
      Scan scan = swept_scan(path_, real, t, random_);
      fault.of_scans(t, scan);
      put(t, channel::kScan, scan);
    }
    add_imu();
    if (camera) add_camera();
  }

  /// Images of a depth camera on the base, and its description. All but the outer walls hang: from `low` to
  /// `high` m above the floor.
  void add_depth(double low, double high) {
    const CameraDescription camera = level_camera(0);
    robot_.depth.emplace();
    robot_.depth->intrinsics = camera.intrinsics;
    robot_.depth->T_base_optical = Transform<Base, DepthOptical>(camera.T_base_optical.isometry());
    for (Message& message : messages_) {
      if (message.channel != channel::kRobot) continue;
      RobotMessage description;
      description.yaml = to_yaml(robot_);
      message.payload.clear();
      encode(description, message.payload);
    }
    for (double t = 0.03; t < path_.duration() - 0.02; t += 0.4) {
      Image like;
      like.stamp = SensorTime{} + seconds(1000 + t);
      like.metadata.push_back({"encoding", {'z', 'l', 'i', 'b'}});
      const auto image = render::encode_depth(hanging_depth(camera, path_.at(t), low, high), like);
      ASSERT_TRUE(image.ok());
      put(t, channel::kDepth, *image);
    }
  }

  void write(const std::filesystem::path& path) {
    std::stable_sort(messages_.begin(), messages_.end(),
                     [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
    auto writer = LogWriter::create(path.string(), true);
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE(writer->write(messages_).ok());
  }

 private:
  template <class T>
  void put(double t, const char* channel, const T& item) {
    Message message{channel, ArrivalTime{(SensorTime{} + seconds(1000 + t)).ns}, {}};
    encode(item, message.payload);
    messages_.push_back(std::move(message));
  }

  void add_camera() {
    for (double t = 0.02; t < path_.duration() - 0.02; t += 0.1) {
      const SensorTime stamp = SensorTime{} + seconds(1000 + t - kCameraOffset);
      put(t, channel::kCamera, textured_image(*robot_.camera, path_.at(t), stamp, random_));
    }
  }

  void add_imu() {
    std::normal_distribution<double> noise;
    for (double t = 0.01; t < path_.duration() - 0.01; t += 0.01) {
      ImuSample sample;
      sample.stamp = SensorTime{} + seconds(1000 + t - kImuOffset);
      const double rate = wrap_angle(path_.at(t + 0.005).yaw - path_.at(t - 0.005).yaw) / 0.01;
      sample.rotation_rate = {0, 0, rate / kImuScale + kImuBias + 0.01 * noise(random_)};
      put(t, channel::kImu, sample);
    }
  }

  std::mt19937 random_;
  DriveErrors errors_;
  SampledPath path_;
  RobotDescription robot_;
  std::vector<Message> messages_;
};

}  // namespace parhelion::test
