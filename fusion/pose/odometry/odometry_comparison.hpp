// Two motions of one robot over the same seconds, as its odometry and as its scans show them: what is wrong
// with odometry.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace parhelion::pose {

enum class OdometryFault : std::uint8_t {
  none,
  frozen,                ///< the robot drives, odometry stands still
  slipping,              ///< odometry moves, the robot stands
  carried,               ///< the robot moves as its wheels cannot, odometry stands still
  reversed,              ///< forward is backward, left is right
  translation_reversed,  ///< forward is backward; or the laser looks backward
  rotation_reversed,     ///< left is right; or the laser is upside down
  wheel,                 ///< one wheel counts too little or too much
  scale,                 ///< distances or angles are wrong by a constant factor
  delayed,               ///< right, but for another instant than its stamps state
  stamps_frozen,         ///< new poses with an old stamp
  stamps_jumped,         ///< stamps are no longer on the clock of the scans
  silent,                ///< no message arrives
  laser_frozen,          ///< the laser repeats one scan
  beam_order,    ///< the laser measures the beams of a message in another order of time than described
  inconsistent,  ///< contradicts the scans in another way
};
/// As in JSON: "rotation_reversed".
const char* to_string(OdometryFault fault);
/// What the fault is, and what to do.
const char* advice(OdometryFault fault);

/// Both motions over some 0.2 s: x along and y across the robot at its begin, m; z rotation, rad.
struct MotionPair {
  double seconds = 0;
  Eigen::Vector3d odometry = Eigen::Vector3d::Zero(), scans = Eigen::Vector3d::Zero();
  /// The scans determine position or yaw without any prior. Otherwise they are not compared.
  bool position_known = false, yaw_known = false;
};

/// odometry = gain * scans, for (m along, rad): the identity where odometry is right. Sign, scale, and the
/// factors of single wheels are entries of `gain` (Antonelli, Chiaverini, Fusco 2005, "A calibration method
/// for odometry of mobile robots based on the least-squares technique").
struct MotionComparison {
  double seconds = 0;
  double path_odometry = 0, path_scans = 0;  ///< m
  double turn_odometry = 0, turn_scans = 0;  ///< rad, sum of absolute values
  Eigen::Vector3d total_odometry = Eigen::Vector3d::Zero(), total_scans = Eigen::Vector3d::Zero();
  double across = 0;  ///< m, path across the robot, by scans

  Eigen::Matrix2d gain = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d gain_sigma = Eigen::Matrix2d::Ones();
  /// Mean squares per pair, m^2, a rotation as the distance at kLever.
  double motion = 0;         ///< of the larger motion
  double contradiction = 0;  ///< of the difference of both
  double misfit = 0;         ///< of what `gain` does not explain

  static constexpr double kLever = 0.3;  ///< m
  bool position_excited() const;         ///< far enough for a statement about distances
  bool yaw_excited() const;
  /// Not only from pair to pair, as stamps or matches that jitter do.
  bool totals_differ() const;
  /// "in 4.0 s odometry +1.20 m and -30.1 degrees, scans ..."
  std::string figures() const;
};

MotionComparison compare(std::span<const MotionPair> pairs);

/// The fault that a comparison shows; `none`: both agree; nullopt: too little motion. `inconsistent` may also
/// be a wrong time offset.
std::optional<OdometryFault> fault_of(const MotionComparison& comparison);

}  // namespace parhelion::pose
