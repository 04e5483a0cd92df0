// The robot's pose at any instant: SLAM corrects, odometry carries.
// pose(t) = T_map_odom (last word of SLAM) * T_odom_base(t), with age and covariance.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/pose.hpp"
#include "protocols/robot.hpp"

namespace parhelion {

struct PoseAtInstant {
  Transform<Map, Base> T_map_base;
  PoseCovariance covariance = PoseCovariance::Zero();  ///< map frame, grown by what odometry carried since the last word of SLAM
  Duration age;     ///< since the stamp of the last word of SLAM
  Twist2 twist;     ///< body frame, from odometry
};

/// Why there is no pose, in words for MR_SCAN_INFO and people.
enum class NoPose : std::uint8_t {
  no_odometry,      ///< nothing within the history at that instant
  no_slam,          ///< SLAM has said nothing yet
  slam_lost,
  relocalizing,     ///< a correction above 0.2 m or 5 degrees: off until the covariance recovers
  older_than_history,
  too_far_ahead,    ///< more than `max_extrapolation` after the last odometry
  map_mismatch,
};
const char* to_string(NoPose why);

struct PoseTrackOptions {
  Duration history = seconds(2.0);
  Duration max_extrapolation = milliseconds(500);
  double relocalization_distance = 0.2;                          ///< m
  double relocalization_angle = 5 * 3.14159265358979323846 / 180;  ///< rad
  double recovered_sigma = 0.05;                                 ///< m, 1 sigma at which injection may return
  std::string map_id;                                            ///< empty: any
};

/// Fixed-size histories; adding never allocates after construction. All instants are SensorTime of the robot's clock.
class PoseTrack {
 public:
  PoseTrack(const RobotDescription& robot, const PoseTrackOptions& options);

  enum class Correction { first, small, relocalization, ignored /* stale, lost or of another map */ };

  /// Backward stamps are kept out and counted.
  void add(const Odometry& odometry);
  Correction add(const PoseEstimate& estimate);

  /// The pose, or why there is none. Never an identity in its place.
  std::optional<PoseAtInstant> at(SensorTime t, NoPose* why = nullptr) const;
  std::uint64_t rejected() const;  ///< inputs kept out

 private:
  struct CarriedPose;
  RobotDescription robot_;
  PoseTrackOptions options_;
  // ... rings and the last correction
};

/// Predicted error (1 sigma, m) of a return at p_map seen from the pose: sqrt of the largest eigenvalue of the planar
/// position covariance that the pose's covariance causes at that place (lever arm of yaw included).
double predicted_error(const PoseAtInstant& pose, const Eigen::Vector3d& p_map);

}  // namespace parhelion
