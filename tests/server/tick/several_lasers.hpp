// A robot with two planar lasers, which look to the front and to the rear, in the synthetic room.
#pragma once

#include <string>
#include <vector>

#include "fusion/scan/lidar_model.hpp"
#include "protocols/channel_map.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::test {

inline const std::string kRear = "rear";
inline const std::string kRearScan = sensor_channel(channel::kScan, kRear);
inline const std::string kMrRearScan = sensor_channel(channel::kMrScan, kRear);
inline const std::string kMrRearScanInfo = sensor_channel(channel::kMrScanInfo, kRear);

/// The synthetic robot, whose laser looks over 270 degrees in 50 ms, and a second one at its rear, with other
/// beams, times and sentinels. `noise`: m, 1 sigma of both.
inline RobotDescription robot_with_two_lasers(double noise = 0.005) {
  RobotDescription description = robot();
  LaserDescription& front = *description.laser;
  front.T_base_laser = Transform<Base, Laser>::planar(0.1, 0, 0, 0.4);
  front.beams = 271;
  front.angle_min = -0.75 * std::numbers::pi;
  front.beam_interval = 0.05 / 270;
  LaserDescription rear = front;
  rear.T_base_laser = Transform<Base, Laser>::planar(-0.2, 0.05, std::numbers::pi - 0.3, 0.45);
  rear.beams = 541;
  rear.angle_increment = std::numbers::pi / 360;
  rear.beam_interval = 0.03 / 540;
  rear.stamp_beam = LaserDescription::StampBeam::last;
  rear.convention.range_max = 20;
  rear.convention.no_return = RangeConvention::Sentinel::infinity;
  front.noise_sigma = rear.noise_sigma = noise;
  if (noise == 0) front.quantization = rear.quantization = 0;
  description.further_lasers = {{kRear, rear}};
  return description;
}

inline tick::Configuration two_lasers_configuration(const std::vector<AgentDefinition>& agents,
                                                    const RobotDescription& robot = robot_with_two_lasers()) {
  Scenario scenario;
  scenario.name = "two lasers";
  scenario.agents = agents;
  auto made = tick::configure(scenario, robot, room());
  EXPECT_TRUE(made.ok()) << (made ? "" : made.error().message);
  return *made;
}

/// What a laser of the robot on its circle measures in the room, without noise; t: s, of its stamp.
inline Scan cast_on_circle(const LaserDescription& laser, double t) {
  Scan scan;
  scan.stamp = SensorTime::from_utime(kStartUs + std::llround(t * 1e6));
  scan.angle_min = static_cast<float>(laser.angle_min);
  scan.angle_increment = static_cast<float>(laser.angle_increment);
  std::vector<float> time;
  const scan::Sweep sweep = scan::beam_times(laser, static_cast<std::size_t>(laser.beams), time);
  std::vector<scan::RangeHit> hits(time.size());
  const auto T_map_laser = [&](Duration after) { return pose_at(t + after.seconds()) * laser.T_base_laser; };
  scan::cast_building_exact({T_map_laser(sweep.start), T_map_laser(sweep.end)},
                            {scan.angle_min, scan.angle_increment, time}, room(), 30, hits);
  for (const scan::RangeHit& hit : hits)
    scan.ranges.push_back(std::isinf(hit.range) ? laser.convention.no_return_sentinel() : hit.range);
  return scan;
}

/// The synthetic drive with the scans of both lasers: the first at 10 Hz, the second at 12.5 Hz. Each arrives
/// 3 ms after its last beam.
inline std::vector<Message> two_lasers_drive(double duration,
                                             const RobotDescription& robot = robot_with_two_lasers()) {
  std::vector<Message> log = drive(duration);
  std::erase_if(log, [](const Message& each) { return each.channel == channel::kScan; });
  for (Message& each : log) {
    if (each.channel != channel::kRobot) continue;
    each = message(channel::kRobot, each.arrival.utime(),
                   RobotMessage{SensorTime::from_utime(kStartUs), to_yaml(robot)});
  }
  const auto add = [&](const std::string& name, const LaserDescription& laser, double first, double period) {
    std::vector<float> time;
    const scan::Sweep sweep = scan::beam_times(laser, static_cast<std::size_t>(laser.beams), time);
    for (int i = 0; first + i * period < duration; ++i) {
      const Scan scan = cast_on_circle(laser, first + i * period);
      log.push_back(message(name, (scan.stamp + sweep.end).utime() + 3000, scan));
    }
  };
  add(channel::kScan, robot.laser_at(0), 0, 0.1);
  add(kRearScan, robot.laser_at(1), 0.047, 0.08);
  std::stable_sort(log.begin(), log.end(),
                   [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  return log;
}

}  // namespace parhelion::test
