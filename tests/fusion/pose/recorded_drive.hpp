// The scans, odometry and reference poses of a log that `parhelion import` wrote.
#pragma once

#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "protocols/bus/log_file.hpp"
#include "protocols/codec.hpp"
#include "protocols/robot.hpp"
#include "tests/fusion/pose/corrupted_odometry.hpp"

namespace parhelion::test {

struct RecordedDrive {
  RobotDescription robot;
  std::vector<DriveInput> inputs;
  std::vector<PoseStamped> reference;
  double seconds = 0;
};

/// nullopt, with a message: no such log, or no robot with a laser in it.
inline std::optional<RecordedDrive> recorded_drive(const std::string& path) {
  auto reader = LogReader::open(path);
  if (!reader) {
    std::printf("  not here: %s\n", reader.error().message.c_str());
    return std::nullopt;
  }
  RecordedDrive drive;
  ArrivalTime first, last;
  const auto read = [](const Message& event, auto& item) {
    return decode(event.channel, event.payload, item).ok();
  };
  for (;;) {
    auto event = reader->next();
    if (!event || !event->has_value()) break;
    const Message& message = **event;
    Scan scan;
    Odometry odometry;
    PoseStamped reference;
    RobotMessage robot;
    if (message.channel == "SCAN" && read(message, scan)) {
      if (first.ns == 0) first = message.arrival;
      last = message.arrival;
      drive.inputs.push_back({std::move(scan), {}});
    } else if (message.channel == "ODOMETRY" && read(message, odometry)) {
      drive.inputs.push_back({{}, odometry});
    } else if (message.channel == "REFERENCE_POSE" && read(message, reference)) {
      drive.reference.push_back(reference);
    } else if (message.channel == "ROBOT" && read(message, robot)) {
      auto description = parse_robot_description(robot.yaml, path);
      if (description) drive.robot = std::move(*description);
    }
  }
  drive.seconds = (last - first).seconds();
  if (!drive.robot.laser) std::printf("  %s: no robot with a laser\n", path.c_str());
  return drive.robot.laser ? std::optional(std::move(drive)) : std::nullopt;
}

}  // namespace parhelion::test
