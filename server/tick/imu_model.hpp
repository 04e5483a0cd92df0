// Model of the inertial sensor of a simulated robot.
#pragma once

#include <cstdint>

#include "protocols/joints.hpp"
#include "protocols/robot.hpp"

namespace parhelion::tick {

/// As of a small MEMS unit (figures of an MTi-30 class): white noise per sample and a bias random walk.
struct ImuErrors {
  double rate_noise = 0.002;         ///< rad/s, 1 sigma of a sample
  double rate_bias = 0.001;          ///< rad/s, 1 sigma of the initial bias
  double rate_walk = 1e-5;           ///< rad/s, 1 sigma of the bias random walk after one second
  double acceleration_noise = 0.02;  ///< m/s^2
  double acceleration_bias = 0.01;   ///< m/s^2
  double acceleration_walk = 1e-4;   ///< m/s^2 after one second
  double attitude_noise = 0.0005;    ///< rad, of roll and of pitch
  double attitude_bias = 0.002;      ///< rad, constant, of roll and of pitch
};

/// Motion of base_link at an instant.
struct BaseMotion {
  Transform<Map, Base> T_map_base;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();       ///< m/s, map frame
  Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();  ///< rad/s, map frame
};

/// Rates, specific force (gravity included: at rest +9.81 upwards) and attitude in the sensor's frame, with
/// the lever arm to base_link. The yaw drifts with the bias of the rate, as without a compass. Noise is keyed
/// by (seed, sample).
class ImuModel {
 public:
  ImuModel(const ImuDescription& imu, const ImuErrors& errors, std::uint64_t seed);

  /// Accelerations are means since the last sample. For the first sample, and after a `restart` (the robot
  /// was moved elsewhere), they are those of a robot at rest.
  ImuSample add(SensorTime stamp, const BaseMotion& motion, bool restart);

 private:
  double draw(std::size_t which) const;
  Eigen::Vector3d draws(std::size_t first) const { return {draw(first), draw(first + 1), draw(first + 2)}; }
  void wander(double dt);

  ImuDescription imu_;
  ImuErrors errors_;
  std::uint64_t seed_;
  std::uint64_t samples_ = 0;
  SensorTime last_stamp_;
  BaseMotion last_;
  Eigen::Vector3d rate_bias_, acceleration_bias_;  ///< sensor frame
  Eigen::Vector3d attitude_bias_;                  ///< roll, pitch, and the accumulated yaw drift
};

}  // namespace parhelion::tick
