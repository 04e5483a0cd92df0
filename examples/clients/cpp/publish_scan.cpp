// Publishes the data that a robot sends to the server: its pose (POSE_COV) and the scans of its laser (SCAN).
//
//   publish_scan        until it is stopped with ^C
//
// The robot is at rest in the middle of a square room. For a real robot, replace the generated pose and
// ranges by those of your localization and laser driver. A robot that moves also publishes its wheel odometry
// on ODOMETRY (pose2D_t), 20 times a second or more.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <thread>

#include "parhelion/planar_lidar_t.hpp"
#include "parhelion/pose_cov_t.hpp"
#include "signature.hpp"

namespace {

using Clock = std::chrono::system_clock;

// The laser of examples/robot/turtlebot4_lite.yaml, in the order of its driver: counter-clockwise.
constexpr double kPi = 3.14159265358979323846;
constexpr int kBeams = 720;
constexpr double kAngleMin = -179.0 / 180 * kPi;                      // rad, of the first beam of a message
constexpr double kAngleIncrement = 359.0 / (kBeams - 1) * kPi / 180;  // rad
constexpr std::chrono::milliseconds kScanPeriod{130};

constexpr double kWallDistance = 3;  // m, from the laser to each of the four walls

/// `utime` is the instant for which the pose holds. A localization uses the stamp of the scan that it
/// matched.
parhelion::pose_cov_t localize(std::int64_t utime) {
  parhelion::pose_cov_t pose{};
  pose.utime = utime;
  pose.orientation[0] = 1;  // w, x, y, z: at the map's origin, facing along its x axis
  for (int i = 0; i < 3; ++i) pose.covariance[7 * i] = 1e-4;  // m^2: 1 cm
  for (int i = 3; i < 6; ++i) pose.covariance[7 * i] = 1e-6;  // rad^2: 1 mrad
  pose.map_id = "";  // id of the map as in the model's file; any without a model
  pose.state = 1;    // tracking
  pose.causal = 1;   // computed from nothing newer than utime
  return pose;
}

/// `utime` is the instant of one beam: the first, the middle or the last, according to `stamp_beam` in the
/// robot description. Its `beam_interval` says which end of a message is measured first.
parhelion::planar_lidar_t measure(std::int64_t utime) {
  parhelion::planar_lidar_t scan{};
  scan.utime = utime;
  scan.rad0 = static_cast<float>(kAngleMin);
  scan.radstep = static_cast<float>(kAngleIncrement);
  for (int i = 0; i < kBeams; ++i) {
    const double angle = kAngleMin + i * kAngleIncrement;
    const double range = kWallDistance / std::max(std::abs(std::cos(angle)), std::abs(std::sin(angle)));
    scan.ranges.push_back(static_cast<float>(range));
  }
  scan.nranges = static_cast<std::int32_t>(scan.ranges.size());
  return scan;
}

}  // namespace

int main() {
  lcm::LCM lcm;  // at LCM_DEFAULT_URL, else on this machine only
  if (!lcm.good()) {
    std::fprintf(stderr, "publish_scan: cannot open LCM; is there a multicast route?\n");
    return 1;
  }
  Publisher publisher(lcm);
  for (auto next = Clock::now();; next += kScanPeriod) {
    std::this_thread::sleep_until(next);
    const std::int64_t now =
        std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch()).count();
    const auto pose = localize(now);
    const auto scan = measure(now);
    publisher.publish("POSE_COV", pose);
    publisher.publish("SCAN", scan);
  }
}
