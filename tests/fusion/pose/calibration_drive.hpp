// Drives with known errors of odometry, mounting and stamps.
#pragma once

#include <random>
#include <vector>

#include "fusion/pose/calibration/motion_calibration.hpp"
#include "tests/fusion/pose/room.hpp"

namespace parhelion::test {

/// What is wrong with a generated drive.
struct DriveErrors {
  OdometryCorrection odometry{1.02, 0.97, 0.01, -0.1};           ///< that would put it right
  Pose2 T_base_laser{0.23, -0.04, 0.05};                         ///< true mounting
  double stamp_jitter = 0.01;                                    ///< s, 1 sigma, of the scans
  double odometry_noise = 0.0005, odometry_turn_noise = 0.0005;  ///< m, rad, per sample of 50 ms
  double laser_noise = 0.004, laser_turn_noise = 0.002;          ///< m, rad, of a pose by scan matching
  double slip = 0.05;  ///< m, of a slip of the wheels each nine seconds
};

/// The true path of the base, sampled each 5 ms: starts, stops, curves both ways and turns on the spot, twice
/// around ring_building().
struct SampledPath {
  static constexpr double kStep = 0.005;  ///< s
  std::vector<Pose2> poses;
  std::vector<Twist2> twists;
  double duration() const { return kStep * static_cast<double>(poses.size() - 1); }
  std::size_t index(double t) const { return static_cast<std::size_t>(std::lround(t / kStep)); }
  /// Within the path.
  Pose2 at(double t) const {
    const auto before = std::min(static_cast<std::size_t>(std::max(t / kStep, 0.0)), poses.size() - 2);
    return interpolate(poses[before], poses[before + 1], t / kStep - static_cast<double>(before));
  }
};

inline SampledPath brisk_path(double rounds = 2) {
  SampledPath path;
  Pose2 pose{3.0, 1.4, 0};
  Twist2 now;
  // Towards the wanted twist within limits of acceleration.
  const auto drive = [&](double v, double w, double seconds) {
    for (double t = 0; t < seconds - 1e-9; t += SampledPath::kStep) {
      const auto towards = [](double from, double to, double largest) {
        return from + std::clamp(to - from, -largest, largest);
      };
      now.vx = towards(now.vx, v, 1.5 * SampledPath::kStep);
      now.wz = towards(now.wz, w, 4.0 * SampledPath::kStep);
      path.poses.push_back(pose);
      path.twists.push_back(now);
      pose = pose * moved(now, SampledPath::kStep);
    }
  };
  const auto stop = [&](double seconds) { drive(0, 0, seconds); };
  const auto turn = [&](double angle) { drive(0, angle < 0 ? -1.0 : 1.0, std::abs(angle)), stop(0.5); };
  const Eigen::Vector2d corners[] = {{10.3, 1.4}, {10.3, 6.8}, {1.8, 6.8}, {1.8, 1.4}};
  const double quarter = std::numbers::pi / 2;
  for (int leg = 0; leg < static_cast<int>(4 * rounds); ++leg) {
    const Eigen::Vector2d ahead = corners[leg % 4] - pose.position();
    turn(wrap_angle(std::atan2(ahead.y(), ahead.x()) - pose.yaw));
    for (double weave = 0.35; (corners[leg % 4] - pose.position()).norm() > 0.9; weave = -weave) {
      drive(0.7, weave, 0.6), drive(0.7, -weave, 0.6);
      if (weave > 0) drive(0.35, 0, 0.4);
    }
    stop(0.8);
    if (leg % 2 == 1) turn(-quarter), turn(quarter);
  }
  return path;
}

/// Odometry at 20 Hz with these errors; its clock is off by the time offset.
inline std::vector<Odometry> odometry_of(const SampledPath& path, const DriveErrors& errors,
                                         std::mt19937& random) {
  std::normal_distribution<double> noise;
  std::vector<Odometry> odometry;
  Pose2 odom;
  constexpr std::size_t stride = 10;
  double slipping = 0;
  for (std::size_t i = 0; i + stride < path.poses.size(); i += stride) {
    const double t = SampledPath::kStep * static_cast<double>(i);
    odometry.push_back(
        {SensorTime{} + seconds(1000 + t - errors.odometry.time_offset), transform<Odom, Base>(odom)});
    const Twist2 step = twist_to(path.poses[i].inverse() * path.poses[i + stride]);
    if (std::fmod(t, 9.0) < 0.04 && t > 1) slipping = 4;
    const double slip = slipping-- > 0 ? errors.slip / 4 : 0;
    const OdometryCorrection& true_value = errors.odometry;
    odom =
        odom * moved({step.vx / true_value.translation_scale + slip + errors.odometry_noise * noise(random),
                      step.vy / true_value.translation_scale + errors.odometry_noise * noise(random),
                      (step.wz - true_value.curvature * step.vx) / true_value.rotation_scale +
                          errors.odometry_turn_noise * noise(random)},
                     1);
  }
  return odometry;
}

/// Poses of the laser at 10 Hz, as a matcher would give them.
inline std::vector<pose::LaserPose> laser_poses_of(const SampledPath& path, const DriveErrors& errors,
                                                   std::mt19937& random) {
  std::normal_distribution<double> noise;
  std::vector<pose::LaserPose> poses;
  for (double t = 0.05; t < path.duration(); t += 0.1) {
    const Pose2 T_map_laser = path.poses[path.index(t)] * errors.T_base_laser *
                              Pose2{errors.laser_noise * noise(random), errors.laser_noise * noise(random),
                                    errors.laser_turn_noise * noise(random)};
    poses.push_back(
        {SensorTime{} + seconds(1000 + t + errors.stamp_jitter * noise(random)), T_map_laser, true});
  }
  return poses;
}

/// A scan of ring_building() by the real robot, each beam from where the laser was at its own time.
inline Scan swept_scan(const SampledPath& path, const RobotDescription& real, double t,
                       std::mt19937& random) {
  static const std::vector<Segment> walls = ring_building();
  constexpr double sigma = 0.01;  // m
  const LaserDescription& laser = *real.laser;
  const auto beams = static_cast<std::size_t>(laser.beams);
  Scan scan;
  scan.stamp = SensorTime{} + seconds(1000 + t);
  scan.angle_min = static_cast<float>(laser.angle_min);
  scan.angle_increment = static_cast<float>(laser.angle_increment);
  std::normal_distribution<double> noise;
  for (std::size_t i = 0; i < beams; ++i) {
    const Pose2 T_map_laser = path.at(t + laser.beam_time(i, beams).seconds()) * planar(laser.T_base_laser);
    const double angle = laser.angle_min + static_cast<double>(i) * laser.angle_increment;
    const double range = cast(walls, T_map_laser.position(), T_map_laser.yaw + angle);
    scan.ranges.push_back(static_cast<float>(range + sigma * noise(random)));
  }
  return scan;
}

}  // namespace parhelion::test
