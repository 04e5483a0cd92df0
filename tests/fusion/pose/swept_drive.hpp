// A drive whose laser measures its beams one after the other over a good part of a scan's period.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "tests/fusion/pose/calibration_drive.hpp"
#include "tests/fusion/pose/corrupted_odometry.hpp"

namespace parhelion::test {

/// The robot as described, the drive's messages in the order of arrival, and where the base was at each scan.
struct SweptDrive {
  RobotDescription robot;
  std::vector<DriveInput> inputs;
  std::vector<Pose2> truth;
};

/// `described`, `real`: s between two beams, by the description and in truth; 0: all at once. Odometry's
/// clock is late by `late` s.
inline SweptDrive swept_drive(std::uint32_t seed, double described, double real, double late = 0,
                              double rounds = 0.5) {
  std::mt19937 random(seed);
  SweptDrive drive;
  drive.robot = robot_with_laser();
  drive.robot.laser->beam_interval = described;
  RobotDescription truly = drive.robot;
  truly.laser->beam_interval = real;
  const SampledPath path = brisk_path(rounds);
  DriveErrors errors;
  errors.odometry = {};
  errors.odometry.time_offset = -late;
  const std::vector<Odometry> odometry = odometry_of(path, errors, random);
  std::size_t next = 0;
  for (double t = 0.2; t < path.duration() - 0.2; t += 0.1) {
    const SensorTime stamp = SensorTime{} + seconds(1000 + t);
    for (; next < odometry.size() && odometry[next].stamp <= stamp; ++next)
      drive.inputs.push_back({std::nullopt, odometry[next]});
    drive.inputs.push_back({swept_scan(path, truly, t, random), {}});
    drive.truth.push_back(path.at(t));
  }
  return drive;
}

}  // namespace parhelion::test
