// A small building of wall segments, a robot that drives in it, and its laser and odometry data.
#pragma once

#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"

namespace parhelion::test {

struct Segment {
  Eigen::Vector2d a, b;
};

inline void add_box(std::vector<Segment>& walls, double x0, double y0, double x1, double y1) {
  walls.push_back({{x0, y0}, {x1, y0}});
  walls.push_back({{x1, y0}, {x1, y1}});
  walls.push_back({{x1, y1}, {x0, y1}});
  walls.push_back({{x0, y1}, {x0, y0}});
}

/// 12 m x 8 m with a block in the middle to drive around, a niche and two pillars: no two places look alike.
inline std::vector<Segment> ring_building() {
  std::vector<Segment> walls;
  add_box(walls, 0, 0, 12, 8);
  add_box(walls, 3, 2.5, 9, 5.5);
  add_box(walls, 0, 6.5, 1.2, 8);
  add_box(walls, 11.2, 3.1, 11.5, 3.6);
  add_box(walls, 5.0, 0, 5.6, 0.5);
  add_box(walls, 7.7, 7.4, 8.0, 8.0);
  return walls;
}

inline double cast(const std::vector<Segment>& walls, const Eigen::Vector2d& p, double angle) {
  const Eigen::Vector2d d(std::cos(angle), std::sin(angle));
  double nearest = std::numeric_limits<double>::infinity();
  for (const Segment& wall : walls) {
    const Eigen::Vector2d e = wall.b - wall.a, r = wall.a - p;
    const double cross = d.x() * e.y() - d.y() * e.x();
    if (std::abs(cross) < 1e-12) continue;
    const double t = (r.x() * e.y() - r.y() * e.x()) / cross, s = (r.x() * d.y() - r.y() * d.x()) / cross;
    if (t > 0 && s >= 0 && s <= 1 && t < nearest) nearest = t;
  }
  return nearest;
}

inline RobotDescription robot_with_laser() {
  RobotDescription robot;
  LaserDescription laser;
  laser.T_base_laser = Transform<Base, Laser>::planar(0.2, 0, 0, 0.3);
  laser.convention.range_min = 0.05F;
  laser.convention.range_max = 30;
  laser.beams = 361;
  laser.angle_min = -std::numbers::pi / 2;
  laser.angle_increment = std::numbers::pi / 360;
  laser.stamp_beam = LaserDescription::StampBeam::first;
  laser.beam_interval = 26.7e-3 / 361;
  robot.laser = laser;
  return robot;
}

/// Each beam from the laser's position at its own time.
inline Scan scan_from(const std::vector<Segment>& walls, const RobotDescription& robot,
                      const Pose2& T_map_base, const Twist2& twist, SensorTime stamp, std::mt19937& random,
                      double sigma = 0.01) {
  const LaserDescription& laser = *robot.laser;
  Scan scan;
  scan.stamp = stamp;
  scan.angle_min = static_cast<float>(laser.angle_min);
  scan.angle_increment = static_cast<float>(laser.angle_increment);
  std::normal_distribution<double> noise;  // times sigma, which may be 0
  for (int i = 0; i < laser.beams; ++i) {
    const auto beam = static_cast<std::size_t>(i);
    const double dt = laser.beam_time(beam, static_cast<std::size_t>(laser.beams)).seconds();
    const Pose2 T_map_laser = T_map_base * moved(twist, dt) * planar(laser.T_base_laser);
    const double angle = static_cast<double>(scan.angle_min) + i * static_cast<double>(scan.angle_increment);
    const double range = cast(walls, T_map_laser.position(), T_map_laser.yaw + angle);
    scan.ranges.push_back(static_cast<float>(range + sigma * noise(random)));
  }
  return scan;
}

struct Sample {
  SensorTime stamp;
  Pose2 T_map_base;  ///< true
  Twist2 twist;
  Odometry odometry;
  Scan scan;
};

/// Around the block counter-clockwise, `rounds` times, at 0.6 m/s; odometry rotates `bias` rad too much per
/// metre.
inline std::vector<Sample> drive(const std::vector<Segment>& walls, const RobotDescription& robot,
                                 double rounds, double bias, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Sample> samples;
  Pose2 pose{3.0, 1.4, 0}, odom;
  const double dt = 0.1, speed = 0.6, turn = 0.6;
  const double legs[] = {7.0, 3.8, 7.0, 3.8};
  SensorTime stamp{1'700'000'000'000'000'000};
  const auto take = [&](const Twist2& twist) {
    samples.push_back({stamp,
                       pose,
                       twist,
                       {stamp, transform<Odom, Base>(odom)},
                       scan_from(walls, robot, pose, twist, stamp, random)});
    pose = pose * moved(twist, dt);
    odom = odom * moved({twist.vx * 1.01, 0, twist.wz + bias * twist.vx}, dt);
    stamp = stamp + seconds(dt);
  };
  for (int leg = 0; leg < static_cast<int>(rounds * 4); ++leg) {
    for (double driven = 0; driven < legs[leg % 4]; driven += speed * dt) take({speed, 0, 0});
    // A quarter turn with radius 0.5 m.
    const int steps = static_cast<int>(std::lround(std::numbers::pi / 2 / (turn * dt)));
    for (int i = 0; i < steps; ++i) take({0.3, 0, std::numbers::pi / 2 / (steps * dt)});
  }
  return samples;
}

}  // namespace parhelion::test
