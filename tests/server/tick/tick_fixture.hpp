// A tick with input messages, for tests of the paths.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/tick/tick.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::test {

/// The synthetic robot with a small camera that looks forwards.
inline RobotDescription robot_with_camera() {
  RobotDescription description = robot();
  CameraDescription camera;
  camera.intrinsics = {64, 48, 60, 60, 32, 24, {}, {}};
  camera.T_base_optical = {Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), {0.2, 0, 1}};
  description.camera = camera;
  return description;
}

/// A grey image of that camera, which arrives 5 ms after its stamp.
inline Message image_at(std::int64_t us) {
  Image image;
  image.stamp = SensorTime::from_utime(us);
  image.width = 64;
  image.height = 48;
  image.format = PixelFormat::gray;
  image.row_stride = 64;
  image.bytes.assign(64 * 48, 100);
  return message(channel::kCamera, us + 5000, image);
}

/// A raw depth image, 64 x 48, of a wall 4 m away.
inline Image depth_of_a_wall(std::int64_t us) {
  Image image;
  image.stamp = SensorTime::from_utime(us);
  image.width = 64;
  image.height = 48;
  image.format = PixelFormat::depth_mm;
  image.row_stride = 128;
  for (int i = 0; i < 64 * 48; ++i) image.bytes.insert(image.bytes.end(), {0xA0, 0x0F});
  image.metadata.push_back({"encoding", {'r', 'a', 'w'}});
  return image;
}

/// Feeds messages to a tick and keeps its outputs.
class TickTest : public testing::Test {
 protected:
  void start(tick::Configuration configuration) {
    configuration_ = std::move(configuration);
    auto made = tick::make_state(configuration_, ArrivalTime::from_utime(kStartUs - 2000));
    ASSERT_TRUE(made.ok()) << made.error().message;
    state_ = std::move(*made);
  }
  void feed(const Message& input) {
    outputs_.clear();
    tick::tick(configuration_, input, *state_, outputs_, observer_);
    keep_outputs();
  }
  void feed(const std::vector<Message>& log) {
    for (const Message& each : log) feed(each);
  }
  void advance_to(ArrivalTime time) {
    outputs_.clear();
    tick::advance(configuration_, time, *state_, outputs_, observer_);
    keep_outputs();
  }
  void keep_outputs() {
    for (const tick::Outputs::Entry& entry : outputs_.entries()) out_[entry.channel].push_back(entry.payload);
  }
  template <class T>
  std::vector<T> decoded(const std::string& channel) {
    std::vector<T> all;
    for (const auto& payload : out_[channel]) {
      T item;
      const Status read = decode(channel, payload, item);
      EXPECT_TRUE(read.ok()) << (read ? "" : read.error().message);
      all.push_back(std::move(item));
    }
    return all;
  }

  /// On SCAN.
  static std::vector<Scan> scans_in(const std::vector<Message>& log) {
    std::vector<Scan> scans;
    for (const Message& each : log) {
      if (each.channel != channel::kScan) continue;
      EXPECT_TRUE(decode(each.channel, each.payload, scans.emplace_back()).ok());
    }
    return scans;
  }

  tick::Configuration configuration_;
  std::unique_ptr<tick::State> state_;
  tick::Outputs outputs_;
  tick::StageObserver observer_;
  std::map<std::string, std::vector<std::vector<std::uint8_t>>> out_;
};

}  // namespace parhelion::test
