// A robot's pose and its uncertainty.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "protocols/frames.hpp"
#include "protocols/time.hpp"

namespace parhelion {

/// Order of rows and columns: x, y, z (m, map frame), roll, pitch, yaw (rad, map frame).
using PoseCovariance = Eigen::Matrix<double, 6, 6>;

enum class SlamState : std::int8_t {
  initializing = 0,  ///< no pose yet: T_map_base is not meaningful
  tracking = 1,
  lost = 2,    ///< T_map_base must not be used
  unsure = 3,  ///< T_map_base is a guess: for display, not for injection
};

/// As printed and in JSON: "tracking".
const char* to_string(SlamState state);

/// One SLAM estimate (POSE_COV).
struct PoseEstimate {
  SensorTime stamp;  ///< instant for which the pose holds: the stamp of the scan that it was matched to
  Transform<Map, Base> T_map_base;
  PoseCovariance covariance = PoseCovariance::Zero();
  std::string map_id;
  SlamState state = SlamState::initializing;
  Duration step_time;  ///< computing time of SLAM
  bool causal = true;  ///< false: computed with later data (final trajectory), never used for injection
};

/// Wheel odometry (ODOMETRY), planar.
struct Odometry {
  SensorTime stamp;
  Transform<Odom, Base> T_odom_base;
};

/// A full pose without covariance (POSE, REFERENCE_POSE).
struct PoseStamped {
  SensorTime stamp;
  Transform<Map, Base> T_map_base;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s, in the frame named by the robot description
  Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();  ///< rad/s, body frame
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();   ///< m/s^2, body frame
};

}  // namespace parhelion
