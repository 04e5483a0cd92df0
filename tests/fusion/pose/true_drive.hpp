// Drives whose truth is known at every instant, worse than recordings usually are: odometry that is late,
// jitters and has a wrong scale, people around the robot, a building that has changed since it was mapped.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "fusion/pose/maps/mapped_scan.hpp"
#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"
#include "tests/fusion/pose/room.hpp"

namespace parhelion::test {

/// What a laser sees of a building, and where a robot drives in it. The building's frame is the map's.
struct TrueBuilding {
  std::vector<Segment> mapped;         ///< when it was mapped
  std::vector<Segment> now;            ///< when the robot drives
  std::vector<Eigen::Vector2d> route;  ///< m, from corner to corner
};

inline void add_turned_box(std::vector<Segment>& walls, const Eigen::Vector2d& centre,
                           const Eigen::Vector2d& size, double yaw) {
  const Eigen::Rotation2Dd turn(yaw);
  std::vector<Segment> box;
  add_box(box, -size.x() / 2, -size.y() / 2, size.x() / 2, size.y() / 2);
  for (const Segment& side : box) walls.push_back({centre + turn * side.a, centre + turn * side.b});
}

/// A corridor of 22 m with rooms of random widths on both sides, each with a doorway of 1 m and three pieces
/// of furniture at random angles. `moved`: fraction of the furniture that stands elsewhere when the robot
/// drives.
inline TrueBuilding office(std::uint32_t seed, double moved = 0) {
  constexpr double length = 22, near = 5, far = 7, depth = 12;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  TrueBuilding building;
  std::vector<Segment>& walls = building.mapped;
  add_box(walls, 0, 0, length, depth);
  std::vector<Segment> furniture_before, furniture_now;
  std::vector<Eigen::Vector2d> doorways;  // on the corridor's side
  for (const double side : {near, far}) {
    for (double x = 0; x < length - 3;) {
      const double end = length - x < 7.5 ? length : x + 3 + 1.5 * unit(random);
      const double door = x + 0.8 + (end - x - 2.6) * unit(random);
      walls.push_back({{x, side}, {door, side}});
      walls.push_back({{door + 1, side}, {end, side}});
      if (end < length) walls.push_back({{end, side == near ? 0 : far}, {end, side == near ? near : depth}});
      const double y = side == near ? 0 : far + 1.5;  // the doorway stays free
      const auto anywhere = [&] {
        return Eigen::Vector2d(x + 0.6 + (end - x - 1.2) * unit(random), y + 0.5 + 2.5 * unit(random));
      };
      for (int piece = 0; piece < 3; ++piece) {
        const Eigen::Vector2d size(0.4 + 0.8 * unit(random), 0.3 + 0.4 * unit(random));
        const Eigen::Vector2d before = anywhere(), after = anywhere();
        const double yaw = 3 * unit(random);
        add_turned_box(furniture_before, before, size, yaw);
        add_turned_box(furniture_now, unit(random) < moved ? after : before, size, yaw);
      }
      doorways.emplace_back(door + 0.5, side);
      x = end;
    }
  }
  building.now = walls;
  walls.insert(walls.end(), furniture_before.begin(), furniture_before.end());
  building.now.insert(building.now.end(), furniture_now.begin(), furniture_now.end());
  // Down the corridor, a look into each doorway, and back.
  std::sort(doorways.begin(), doorways.end(),
            [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() < b.x(); });
  building.route.emplace_back(1, 6);
  for (const Eigen::Vector2d& doorway : doorways) {
    building.route.emplace_back(doorway.x(), 6);
    building.route.emplace_back(doorway.x(), doorway.y() == near ? near - 0.3 : far + 0.3);
    building.route.emplace_back(doorway.x(), 6);
  }
  building.route.emplace_back(1, 6);
  return building;
}

/// Two walls, longer than the laser's range: nothing says how far along them the robot is.
inline TrueBuilding long_corridor() {
  TrueBuilding building;
  add_box(building.mapped, -60, 0, 60, 2.4);
  building.now = building.mapped;
  building.route = {{-12, 1.2}, {12, 1.3}};
  return building;
}

/// Only one straight wall is within the laser's range.
inline TrueBuilding empty_hall() {
  TrueBuilding building;
  add_box(building.mapped, -60, 0, 60, 120);
  building.now = building.mapped;
  building.route = {{-8, 3}, {-2, 9}, {4, 4}, {8, 10}};
  return building;
}

struct TrueDriveOptions {
  std::uint32_t seed = 1;
  double speed = 0.6;             ///< m/s
  double scan_period = 0.1;       ///< s
  double scan_jitter = 0;         ///< s, sigma: a scan is taken that much beside the instant of its stamp
  double odometry_period = 0.05;  ///< s
  double odometry_late = 0.1;     ///< s, its stamps are after the instants at which it holds
  double odometry_jitter = 0.02;  ///< s, uniform, added to that; at most half a period
  double odometry_scale = 1.02;   ///< of what it says to what was driven and turned
  double odometry_bend = 0;       ///< rad, added to its turn for each metre
  double odometry_noise = 0.01;   ///< m per square root of a metre, and rad per square root of a radian
  double range_sigma = 0.01;      ///< m
  int people = 0;                 ///< that walk around the robot, 0.8 to 2.5 m away
};

struct TrueScan {
  Scan scan;
  Pose2 T_map_base;  ///< when it was taken
  Twist2 twist;      ///< body frame
};

/// Where a robot was that drives along a route: in fine steps, with limited accelerations.
class TruePath {
 public:
  static constexpr double kStep = 0.01;  ///< s

  TruePath(const std::vector<Eigen::Vector2d>& route, double speed) {
    const Eigen::Vector2d first = route.at(1) - route.at(0);
    Pose2 pose{route[0].x(), route[0].y(), std::atan2(first.y(), first.x())};
    Twist2 twist;
    for (int i = 0; i < kStandStill; ++i) poses_.push_back(pose);
    for (std::size_t goal = 1; goal < route.size();) {
      const Eigen::Vector2d to_goal = route[goal] - pose.position();
      if (to_goal.norm() < 0.15) {
        ++goal;
        continue;
      }
      const double off = wrap_angle(std::atan2(to_goal.y(), to_goal.x()) - pose.yaw);
      const double wanted = std::abs(off) > 0.5 ? 0 : std::min(speed, 0.1 + to_goal.norm()) * std::cos(off);
      twist.vx += std::clamp(wanted - twist.vx, -0.8 * kStep, 0.8 * kStep);
      twist.wz += std::clamp(std::clamp(2 * off, -1.0, 1.0) - twist.wz, -3 * kStep, 3 * kStep);
      pose = pose * moved(twist, kStep);
      poses_.push_back(pose);
    }
  }

  double seconds() const { return kStep * static_cast<double>(poses_.size() - 1); }
  /// Before its start and after its end the robot stands.
  Pose2 at(double t) const {
    const double steps = std::clamp(t / kStep, 0.0, static_cast<double>(poses_.size() - 1));
    const auto before = std::min(static_cast<std::size_t>(steps), poses_.size() - 2);
    return interpolate(poses_[before], poses_[before + 1], steps - static_cast<double>(before));
  }
  Twist2 twist_at(double t) const { return twist_between(at(t - kStep / 2), at(t + kStep / 2), kStep); }

 private:
  static constexpr int kStandStill = 100;  ///< steps at the start
  std::vector<Pose2> poses_;
};

/// Somebody who walks around the robot: where it is, not through walls.
struct Walker {
  double distance, phase, rate;  ///< m, rad, rad/s

  Eigen::Vector2d at(const Eigen::Vector2d& robot, double t) const {
    const double angle = phase + rate * t, away = distance + 0.3 * std::sin(0.7 * t + phase);
    return robot + away * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
};

/// Range to a leg's surface, seen from p; infinity: missed.
inline double cast_at_leg(const Eigen::Vector2d& centre, const Eigen::Vector2d& p, double angle) {
  constexpr double radius = 0.07;
  const Eigen::Vector2d d(std::cos(angle), std::sin(angle)), r = centre - p;
  const double along = r.dot(d), square = radius * radius - (r.squaredNorm() - along * along);
  if (square < 0 || along < radius) return std::numeric_limits<double>::infinity();
  return along - std::sqrt(square);
}

/// Inputs in the order of their stamps, each kind for itself; odometry is stamped when it arrives.
struct TrueDrive {
  static constexpr std::int64_t kStart = 1'700'000'000'000'000'000;  ///< ns

  RobotDescription robot;
  std::vector<TrueScan> scans;
  std::vector<Odometry> odometry;
  TruePath path;

  Pose2 at(SensorTime stamp) const { return path.at((stamp - SensorTime{kStart}).seconds()); }
};

inline std::vector<Odometry> late_odometry(const TruePath& path, const TrueDriveOptions& options,
                                           std::mt19937& random) {
  std::vector<Odometry> odometry;
  std::normal_distribution<double> noise;
  std::uniform_real_distribution<double> jitter(-options.odometry_jitter, options.odometry_jitter);
  Pose2 odom, before = path.at(0);
  for (double t = 0; t < path.seconds(); t += options.odometry_period) {
    const Pose2 now = path.at(t);
    Twist2 step = twist_to(before.inverse() * now);
    const double sigma = options.odometry_noise, driven = std::abs(step.vx);
    step.vx = options.odometry_scale * step.vx + sigma * std::sqrt(std::abs(step.vx)) * noise(random);
    step.wz = options.odometry_scale * step.wz + sigma * std::sqrt(std::abs(step.wz)) * noise(random);
    step.wz += options.odometry_bend * driven;
    odom = odom * moved(step, 1);
    before = now;
    const SensorTime stamp =
        SensorTime{TrueDrive::kStart} + parhelion::seconds(t + options.odometry_late + jitter(random));
    odometry.push_back({stamp, transform<Odom, Base>(odom)});
  }
  return odometry;
}

/// Each beam from where the laser was at its own time.
inline Scan true_scan(const std::vector<Segment>& walls, const std::vector<Walker>& walkers,
                      const RobotDescription& robot, const TruePath& path, double t, double sigma,
                      std::mt19937& random) {
  const LaserDescription& laser = *robot.laser;
  Scan scan;
  scan.stamp = SensorTime{TrueDrive::kStart} + parhelion::seconds(t);
  scan.angle_min = static_cast<float>(laser.angle_min);
  scan.angle_increment = static_cast<float>(laser.angle_increment);
  std::normal_distribution<double> noise;
  for (std::size_t i = 0; i < static_cast<std::size_t>(laser.beams); ++i) {
    const double at = t + laser.beam_time(i, static_cast<std::size_t>(laser.beams)).seconds();
    const Pose2 T_map_base = path.at(at), T_map_laser = T_map_base * planar(laser.T_base_laser);
    const double angle = T_map_laser.yaw + laser.angle_min + static_cast<double>(i) * laser.angle_increment;
    double range = cast(walls, T_map_laser.position(), angle);
    for (const Walker& walker : walkers) {
      const Eigen::Vector2d middle = walker.at(T_map_base.position(), at);
      const Eigen::Vector2d stride(0.15 * std::sin(4 * at + walker.phase), 0.12);
      range = std::min(range, cast_at_leg(middle + stride, T_map_laser.position(), angle));
      range = std::min(range, cast_at_leg(middle - stride, T_map_laser.position(), angle));
    }
    range += sigma * noise(random);
    const bool seen = range < static_cast<double>(laser.convention.range_max);
    scan.ranges.push_back(seen ? static_cast<float>(range) : laser.convention.no_return_sentinel());
  }
  return scan;
}

/// The walls that a laser may see from somewhere within a metre of p.
inline std::vector<Segment> walls_near(const std::vector<Segment>& walls, const Eigen::Vector2d& p,
                                       double range_max) {
  std::vector<Segment> near;
  std::copy_if(walls.begin(), walls.end(), std::back_inserter(near), [&](const Segment& wall) {
    return ((wall.a + wall.b) / 2 - p).norm() < range_max + (wall.b - wall.a).norm() / 2 + 1;
  });
  return near;
}

inline TrueDrive true_drive(const TrueBuilding& building, const RobotDescription& robot,
                            const TrueDriveOptions& options) {
  std::mt19937 random(options.seed);
  TrueDrive drive{robot, {}, {}, TruePath(building.route, options.speed)};
  drive.odometry = late_odometry(drive.path, options, random);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Walker> walkers;
  for (int i = 0; i < options.people; ++i)
    walkers.push_back({0.8 + 1.7 * unit(random), 6.28 * unit(random), 0.4 * (unit(random) - 0.5)});
  const double range_max = static_cast<double>(robot.laser->convention.range_max);
  std::normal_distribution<double> jitter;
  for (double t = 0.3; t + 0.1 < drive.path.seconds(); t += options.scan_period) {
    const double taken = options.scan_jitter == 0 ? t : t + options.scan_jitter * jitter(random);
    const Pose2 pose = drive.path.at(taken);
    const auto walls = walls_near(building.now, pose.position(), range_max);
    Scan scan = true_scan(walls, walkers, robot, drive.path, taken, options.range_sigma, random);
    scan.stamp = SensorTime{TrueDrive::kStart} + parhelion::seconds(t);
    drive.scans.push_back({std::move(scan), pose, drive.path.twist_at(taken)});
  }
  return drive;
}

/// The building as a perfect mapper would have mapped it: scans at their true poses every 0.25 m or 0.3 rad,
/// each taken at one instant.
inline std::vector<pose::MappedScan> true_map(const TrueBuilding& building, const RobotDescription& robot,
                                              double range_sigma = 0.01, std::uint32_t seed = 99) {
  std::mt19937 random(seed);
  std::vector<pose::MappedScan> map;
  const TruePath path(building.route, 0.6);
  for (double t = 0; t < path.seconds(); t += TruePath::kStep) {
    const Pose2 pose = path.at(t);
    if (!map.empty()) {
      const Pose2 step = map.back().T_map_base.inverse() * pose;
      if (step.position().norm() < 0.25 && std::abs(step.yaw) < 0.3) continue;
    }
    RobotDescription frozen = robot;
    frozen.laser->beam_interval = frozen.laser->pass_period = 0;
    pose::MappedScan scan;
    scan.T_map_base = pose;
    scan.T_base_laser = robot.laser->T_base_laser;
    scan.range_max = static_cast<double>(robot.laser->convention.range_max);
    scan.scan = true_scan(building.mapped, {}, frozen, path, t, range_sigma, random);
    for (float& range : scan.scan.ranges) {
      if (robot.laser->convention.classify(range) != BeamKind::hit)
        range = std::numeric_limits<float>::quiet_NaN();
    }
    map.push_back(std::move(scan));
  }
  return map;
}

}  // namespace parhelion::test
