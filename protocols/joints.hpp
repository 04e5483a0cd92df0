// Joints by name (JOINT_STATE, JOINT_CMD, MR_JOINT_CMD), and samples of an inertial sensor (IMU).
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocols/time.hpp"

namespace parhelion {

/// One sample of an inertial sensor (IMU), in the sensor's own frame.
struct ImuSample {
  SensorTime stamp;  ///< instant of the measurement
  /// The sensor in a frame whose z axis points up; its yaw is arbitrary. None: the sensor estimates none.
  std::optional<Eigen::Quaterniond> orientation;
  Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< m/s^2, gravity included: at rest +9.81 upwards
};

/// Joint positions from encoders, or commanded joint motion. Each of the three lists is empty (not given) or
/// as long as `names`.
struct Joints {
  SensorTime stamp;  ///< instant of the measurement, or when the command was sent, on the sender's clock
  std::vector<std::string> names;  ///< without duplicates, as in the robot description
  std::vector<double> positions;   ///< rad for a revolute joint, m for a prismatic one
  std::vector<double> velocities;  ///< rad/s or m/s
  std::vector<double> efforts;     ///< N m or N
};

}  // namespace parhelion
