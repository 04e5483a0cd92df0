// The robot's pose at any instant: odometry, corrected by SLAM.
// pose(t) = T_map_odom (last SLAM estimate) * T_odom_base(t), with age and covariance.
#pragma once

#include <optional>
#include <string>

#include "fusion/pose/odometry_correction.hpp"
#include "fusion/pose/odometry_drift.hpp"
#include "fusion/pose/odometry_track.hpp"
#include "fusion/pose/ring.hpp"
#include "protocols/pose.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

struct PoseAtInstant {
  Transform<Map, Base> T_map_base;
  PoseCovariance covariance =
      PoseCovariance::Zero();  ///< map frame, including odometry drift since the last SLAM estimate
  Duration age;  ///< since the stamp of the last SLAM estimate; negative for an instant before it
  bool attitude_known = false;  ///< roll and pitch are measured; else they are those of planar SLAM: zero
  Twist2 twist;                 ///< body frame, from odometry (without odometry: from two SLAM estimates)
};

/// Why there is no pose, for MR_SCAN_INFO and messages.
enum class NoPose : std::uint8_t {
  no_odometry,  ///< no sample within the history at that instant
  no_slam,      ///< no SLAM estimate received yet
  slam_lost,
  relocalizing,  ///< a correction above 0.2 m or 5 degrees: until the covariance recovers
  older_than_history,
  too_far_ahead,  ///< more than `max_extrapolation` after the last odometry
  map_mismatch,
};
const char* to_string(NoPose why);

struct PoseTrackOptions {
  Duration history = seconds(2.0);
  Duration max_extrapolation = milliseconds(500);
  double relocalization_distance = 0.2;                            ///< m
  double relocalization_angle = 5 * 3.14159265358979323846 / 180;  ///< rad
  double recovered_sigma = 0.05;  ///< m, 1 sigma below which injection resumes
  std::string map_id;             ///< empty: any
};

/// Fixed-size histories; adding never allocates after construction. All instants are SensorTime of the
/// robot's clock.
///
/// With odometry, the pose is propagated between SLAM estimates: along arcs of constant twist between two
/// samples, and with the last twist beyond them. A SLAM estimate for an instant that odometry has not reached
/// yet is placed by extrapolation and placed again when odometry arrives. Without any odometry (a hand-held
/// camera), SLAM estimates are interpolated, and extrapolated beyond the last.
///
/// A stamp that jumps back by more than the history means that the sensor's clock restarted: the history is
/// cleared.
class PoseTrack {
 public:
  PoseTrack(const RobotDescription& robot, const PoseTrackOptions& options);

  enum class Correction {
    first,
    small,
    relocalization,
    ignored /* stale, lost, of another map or not causal */
  };

  /// Backward stamps are rejected and counted.
  void add(const Odometry& odometry);
  Correction add(const PoseEstimate& estimate);

  /// The pose, or why there is none. Never an identity instead.
  std::optional<PoseAtInstant> at(SensorTime t, NoPose* why = nullptr) const;
  std::uint64_t rejected() const { return rejected_; }  ///< number of rejected inputs
  bool has_odometry() const { return !odometry_.empty(); }

 private:
  struct EstimateSample {
    SensorTime stamp;
    Transform<Map, Base> T_map_base;
    PoseCovariance covariance = PoseCovariance::Zero();
    bool jumped = false;  ///< must not be interpolated from the previous one
  };
  std::optional<PoseAtInstant> from_odometry(SensorTime t, NoPose& why) const;
  std::optional<PoseAtInstant> from_estimates(SensorTime t, NoPose& why) const;
  std::optional<PoseAtInstant> predict(SensorTime t, NoPose& why) const;
  Transform<Map, Base> expected_pose(SensorTime t) const;
  PoseCovariance extrapolation_growth(double dt) const;
  bool align_odometry(const EstimateSample& estimate);
  void learn(const EstimateSample& estimate, const Transform<Map, Base>& expected);
  void restart();

  RobotDescription robot_;
  PoseTrackOptions options_;
  CorrectedOdometry corrected_;
  OdometryTrack odometry_;
  OdometryDrift odometry_drift_;
  Ring<EstimateSample> estimates_;
  std::optional<Transform<Map, Odom>> T_map_odom_;
  OdometryAtInstant at_correction_;  ///< odometry at the stamp of the last SLAM estimate
  bool provisional_ = false;         ///< at_correction_ was extrapolated: aligned again when odometry arrives
  bool lost_ = false;
  bool relocalizing_ = false;
  bool mismatch_ = false;
  std::uint64_t rejected_ = 0;
};

/// Predicted error (1 sigma, m) of a return at p_map seen from the pose: square root of the largest
/// eigenvalue of the planar position covariance at that point, caused by the pose's covariance (including the
/// lever arm of yaw).
double predicted_error(const PoseAtInstant& pose, const Eigen::Vector3d& p_map);

}  // namespace parhelion::pose
