// The robot's pose at any instant: odometry, corrected by SLAM and by scans matched to the map.
// pose(t) = T_map_odom (last correction) * T_odom_base(t), with age and covariance.
#pragma once

#include <optional>
#include <string>

#include "fusion/pose/odometry/odometry_correction.hpp"
#include "fusion/pose/odometry/odometry_drift.hpp"
#include "fusion/pose/odometry/online_odometry_calibration.hpp"
#include "fusion/pose/odometry/scan_motion.hpp"
#include "fusion/pose/scan_refinement.hpp"
#include "fusion/pose/tracks/odometry_track.hpp"
#include "fusion/pose/tracks/ring.hpp"
#include "protocols/pose.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

struct PoseAtInstant {
  Transform<Map, Base> T_map_base;
  PoseCovariance covariance =
      PoseCovariance::Zero();  ///< map frame, including odometry drift since the last correction
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
  slam_silent,  ///< no estimate for a while, in which the robot moved
  jumping,      ///< one relocalization after another
};
const char* to_string(NoPose why);

struct PoseTrackOptions {
  Duration history = seconds(2.0);
  Duration max_extrapolation = milliseconds(500);
  double relocalization_distance = 0.2;                            ///< m
  double relocalization_angle = 5 * 3.14159265358979323846 / 180;  ///< rad
  double recovered_sigma = 0.05;  ///< m, 1 sigma below which injection resumes
  /// The third relocalization within it means that SLAM does not know where the robot is, until none has come
  /// for `steady_after`.
  Duration jumps_within = seconds(5.0), steady_after = seconds(3.0);
  bool calibrate_odometry = true;        ///< its time offset and scale, from matched scans
  Duration max_slam_age = seconds(2.0);  ///< without an estimate for longer, scans are matched no more
  /// SLAM counts as silent once the robot has moved for this long since the newest estimate, and by odometry
  /// is one of the two ways from it. A localization may send nothing while the robot stands: AMCL's defaults
  /// ask for 0.25 m on an axis or 0.2 rad before it does, slam_toolbox's for 0.5 m or 0.5 rad, and either may
  /// take a second. Up to here odometry carries the pose well.
  Duration max_silence = seconds(2.0);
  double silent_distance = 1.0;  ///< m
  double silent_angle = 0.8;     ///< rad
  std::string map_id;            ///< empty: any
};

/// Fixed-size histories; adding never allocates after construction. All instants are SensorTime of the
/// robot's clock.
///
/// With odometry, the pose is propagated between SLAM estimates: along arcs of constant twist between two
/// samples, and with the last twist beyond them. A SLAM estimate for an instant that odometry has not reached
/// yet is placed by extrapolation and placed again when odometry arrives. Without any odometry (a hand-held
/// camera), SLAM estimates are interpolated, and extrapolated beyond the last.
///
/// A scan that was matched to the map (refine) corrects the pose as an estimate for its stamp would. SLAM
/// stays the source: it decides whether there is a pose, and where the two disagree by more than their
/// covariances allow, its estimate replaces what scans gave. Where odometry predicts the scans clearly worse
/// than their own motion does, that motion carries the pose in its place. Time offset and scale of odometry
/// are followed by such scans, and taken out of odometry as it comes in.
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
    jump,   /* one relocalization too many: see PoseTrackOptions::jumps_within */
    ignored /* stale, lost, of another map or not causal */
  };

  /// Backward stamps are rejected and counted.
  void add(const Odometry& odometry);
  Correction add(const PoseEstimate& estimate);

  /// What a match of the scan with this stamp may start from; none: it cannot be matched.
  std::optional<MatchPrior> match_prior(SensorTime stamp) const;
  /// The pose of a scan that was matched from match_prior(stamp). `covariance`: x, y, yaw, map frame.
  /// `twist`: as the scan shows it, body frame; it is used for the rest of the sweep, until odometry takes
  /// over.
  void refine(SensorTime stamp, const Pose2& T_map_base, const Eigen::Matrix3d& covariance,
              const std::optional<Twist2>& twist = std::nullopt);

  /// The pose, or why there is none. Never an identity instead.
  std::optional<PoseAtInstant> at(SensorTime t, NoPose* why = nullptr) const;
  std::uint64_t rejected() const { return rejected_; }  ///< number of rejected inputs
  /// Of odometry, as scans show it, in addition to the robot description's.
  const OnlineOdometryCalibration& calibration() const { return calibration_; }
  bool has_odometry() const { return !odometry_.empty(); }
  /// T_odom_base by odometry with its followed offset and scale, not by a pose of SLAM or of a scan; nullopt:
  /// no sample within the history there.
  std::optional<Pose2> odometry_at(SensorTime t) const;

  /// Since the newest estimate of SLAM.
  struct Silence {
    Duration time;
    double distance = 0, angle = 0;  ///< m and rad, the farthest that odometry was from there
  };
  /// Has a value while NoPose::slam_silent is why there is no pose.
  std::optional<Silence> silence(SensorTime t) const;

 private:
  struct EstimateSample {
    SensorTime stamp;
    Transform<Map, Base> T_map_base;
    PoseCovariance covariance = PoseCovariance::Zero();
    bool jumped = false;  ///< must not be interpolated from the previous one
  };
  /// What the pose is carried from by odometry.
  struct Anchor {
    SensorTime stamp;
    Transform<Map, Base> T_map_base;
    PoseCovariance covariance = PoseCovariance::Zero();
    OdometryAtInstant odometry;   ///< at the stamp
    std::optional<Twist2> twist;  ///< body frame, as its scan shows it
    bool provisional = false;     ///< `odometry` was extrapolated: taken again when odometry arrives
  };
  std::optional<PoseAtInstant> from_odometry(SensorTime t, NoPose& why) const;
  std::optional<PoseAtInstant> from_estimates(SensorTime t, NoPose& why) const;
  std::optional<PoseAtInstant> predict(SensorTime t, NoPose& why) const;
  Transform<Map, Base> expected_pose(SensorTime t) const;
  PoseCovariance extrapolation_growth(double dt) const;
  /// False: odometry has a gap there.
  bool anchor(const EstimateSample& correction);
  std::optional<PoseAtInstant> from_scans(SensorTime t) const;
  Pose2 motion_in_sweep(SensorTime t, const Twist2& twist) const;
  bool take_odometry_at_anchor();
  void learn_drift();
  const EstimateSample* refinement_at(SensorTime stamp) const;
  bool agrees_with_scans(const EstimateSample& estimate) const;
  void restart();
  void measure_silent_motion();
  void note_jump(SensorTime stamp);

  RobotDescription robot_;
  PoseTrackOptions options_;
  CorrectedOdometry corrected_;
  OnlineOdometryCalibration calibration_;
  FollowedCorrection followed_;
  OdometryTrack odometry_;
  OdometryDrift odometry_drift_;
  Ring<EstimateSample> estimates_;    ///< of SLAM
  Ring<EstimateSample> refinements_;  ///< of scans matched to the map
  ScanMotion scan_motion_;
  std::optional<Anchor> anchor_, previous_anchor_;
  Transform<Map, Odom> T_map_odom_;            ///< valid where there is an anchor
  std::optional<Pose2> odometry_at_estimate_;  ///< T_odom_base at the newest of SLAM
  std::optional<SensorTime> moves_since_;      ///< then
  double silent_distance_ = 0, silent_angle_ = 0;
  std::optional<SensorTime> last_jump_, jump_before_;
  bool jumping_ = false;
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
