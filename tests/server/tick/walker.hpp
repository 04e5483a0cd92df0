// Somebody on two legs in made-up scans.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "protocols/channels.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::test {

/// Range from the laser to a leg (a cylinder of 7 cm radius) along a beam; infinity beside it.
inline double leg_range(const Eigen::Vector2d& eye, double angle, const Eigen::Vector2d& leg) {
  const Eigen::Vector2d d(std::cos(angle), std::sin(angle)), f = leg - eye;
  const double along = f.dot(d), off2 = f.squaredNorm() - along * along;
  constexpr double r2 = 0.07 * 0.07;
  return along > 0 && off2 < r2 ? along - std::sqrt(r2 - off2) : std::numeric_limits<double>::infinity();
}

/// Puts the legs of somebody at `place` (m, map) into a scan taken from T_map_laser; `t`: s, for the gait.
inline void put_walker(const Eigen::Vector2d& place, double t, const Transform<Map, Laser>& T_map_laser,
                       Scan& scan) {
  const Eigen::Vector2d eye = T_map_laser.translation().head<2>();
  const double swing = 0.25 * std::sin(2 * std::numbers::pi * 0.8 * t);
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double angle = T_map_laser.yaw() + scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector2d leg = place + Eigen::Vector2d(0.1 * side, swing * side);
      scan.ranges[i] = std::min(scan.ranges[i], static_cast<float>(leg_range(eye, angle, leg)));
    }
  }
}

/// The circle of the synthetic robot, with somebody in its scans; `walker_at(t)`: m, map.
template <class Walk>
std::vector<Message> drive_past_a_walker(double duration, Walk walker_at) {
  std::vector<Message> log = drive(duration);
  const LaserDescription laser = *robot().laser;
  for (Message& each : log) {
    if (each.channel != channel::kScan) continue;
    Scan scan;
    EXPECT_TRUE(decode(each.channel, each.payload, scan).ok());
    const double t = static_cast<double>(scan.stamp.utime() - kStartUs) * 1e-6;
    put_walker(walker_at(t), t, pose_at(t) * laser.T_base_laser, scan);
    each = message(channel::kScan, each.arrival.utime(), scan);
  }
  return log;
}

}  // namespace parhelion::test
