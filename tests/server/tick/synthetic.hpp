// A synthetic recording: a robot that drives a circle in a furnished room, with scans cast in that room.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "fusion/scan/augment.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/tick/configuration.hpp"
#include "tests/server/tick/exact_scan.hpp"
#include "tests/server/tick/message.hpp"

namespace parhelion::test {

inline ModelEntity wall(const std::string& name, double x, double y, double yaw, double length) {
  ModelEntity entity;
  entity.name = name;
  entity.label = EntityLabel::wall;
  entity.T_map_body = Transform<Map, Body>::planar(x, y, yaw, 1.25);
  entity.size = {length, 0.1, 2.5};
  return entity;
}

/// A room of 10 m x 8 m about the origin.
inline SemanticModel room() {
  SemanticModel model;
  model.map_id = "synthetic";
  model.entities = {wall("wall 1", 0, -4, 0, 9.8), wall("wall 2", 0, 4, 0, 9.8),
                    wall("wall 3", -5, 0, std::numbers::pi / 2, 7.8),
                    wall("wall 4", 5, 0, std::numbers::pi / 2, 7.8)};
  return model;
}

inline RobotDescription robot() {
  RobotDescription robot;
  robot.name = "synthetic";
  LaserDescription laser;
  laser.T_base_laser = Transform<Base, Laser>::planar(0.1, 0, 0, 0.3);
  laser.convention.range_min = 0.05F;
  laser.convention.range_max = 30;
  laser.convention.no_return = RangeConvention::Sentinel::value;
  laser.convention.no_return_value = 81.83F;
  laser.convention.too_close = RangeConvention::Sentinel::value;
  laser.convention.too_close_value = 0;
  laser.passes = 1;
  laser.beam_interval = 1e-5;
  laser.noise_sigma = 0.005;
  laser.quantization = 0.01;
  laser.beams = 181;
  laser.angle_min = -std::numbers::pi / 2;
  laser.angle_increment = std::numbers::pi / 180;
  robot.laser = laser;
  robot.footprint = {{-0.3, -0.25}, {0.3, -0.25}, {0.3, 0.25}, {-0.3, 0.25}};
  return robot;
}

inline AgentDefinition agent(const std::string& name, AgentKind kind, double x, double y,
                             BehaviourKind behaviour = BehaviourKind::stay) {
  AgentDefinition agent;
  agent.name = name;
  agent.kind = kind;
  agent.T_map_base = Transform<Map, Base>::planar(x, y, 0);
  agent.behaviour.kind = behaviour;
  agent.behaviour.speed = 0.3;
  return agent;
}

inline tick::Configuration configuration(std::vector<AgentDefinition> agents) {
  Scenario scenario;
  scenario.name = "synthetic";
  scenario.agents = std::move(agents);
  return *tick::configure(scenario, robot(), room());
}

constexpr std::int64_t kStartUs = 1'700'000'000'000'000;

/// Pose on a circle of 1.5 m radius, one turn in 40 s.
inline Transform<Map, Base> pose_at(double t) {
  const double angle = 2 * std::numbers::pi * t / 40;
  return Transform<Map, Base>::planar(1.5 * std::cos(angle), 1.5 * std::sin(angle),
                                      angle + std::numbers::pi / 2);
}

inline Scan scan_at(double t) {
  return exact_scan(*robot().laser, pose_at(t), room(),
                    SensorTime::from_utime(kStartUs + static_cast<std::int64_t>(t * 1e6)));
}

/// ODOMETRY at 20 Hz, SCAN at 10 Hz, POSE_COV 20 ms after each scan; `extra` are merged in by arrival.
inline std::vector<Message> drive(double duration, std::vector<Message> extra = {}) {
  std::vector<Message> log = std::move(extra);
  log.push_back(message(channel::kRobot, kStartUs - 1000,
                        RobotMessage{SensorTime::from_utime(kStartUs), to_yaml(robot())}));
  for (int i = 0; i * 0.05 < duration; ++i) {
    const double t = i * 0.05;
    const std::int64_t utime = kStartUs + static_cast<std::int64_t>(t * 1e6);
    Odometry odometry{SensorTime::from_utime(utime), pose_at(t).as<Odom, Base>()};
    log.push_back(message(channel::kOdometry, utime + 2000, odometry));
    if (i % 2 != 0) continue;
    log.push_back(message(channel::kScan, utime + 5000, scan_at(t)));
    PoseEstimate estimate;
    estimate.stamp = SensorTime::from_utime(utime);
    estimate.T_map_base = pose_at(t);
    estimate.covariance = PoseCovariance::Identity() * 1e-4;
    estimate.covariance(5, 5) = 1e-6;
    estimate.map_id = "synthetic";
    estimate.state = SlamState::tracking;
    log.push_back(message(channel::kPoseCov, utime + 25000, estimate));
  }
  std::stable_sort(log.begin(), log.end(),
                   [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  return log;
}

inline void write_log(const std::filesystem::path& path, const std::vector<Message>& messages) {
  auto writer = LogWriter::create(path.string(), true);
  ASSERT_TRUE(writer.ok());
  for (const Message& each : messages)
    ASSERT_TRUE(writer->write(each.channel, each.arrival, each.payload).ok());
}

}  // namespace parhelion::test
