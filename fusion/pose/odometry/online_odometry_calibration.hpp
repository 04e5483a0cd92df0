// Time offset and scale of odometry, followed while the robot drives, from scans that were matched to a map.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "fusion/pose/tracks/odometry_track.hpp"
#include "fusion/pose/tracks/ring.hpp"
#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

/// A Kalman filter of three states that change slowly: the time to add to odometry's stamps, and the scales
/// of its translation and rotation (as in Kelly and Sukhatme 2014, "A General Framework for Temporal
/// Calibration of Multiple Proprioceptive and Exteroceptive Sensors", with scans for the exteroceptive
/// sensor, linearised for each step). A measurement is the robot's motion over some 0.25 s, along the robot
/// and about z, by scans against odometry:
///
///   scans - scale * odometry(offset) = noise,   d odometry / d offset = -(twist at the end - twist at the
///   begin)
///
/// so that the offset is learned where the robot accelerates, a scale where it moves, and nothing where it
/// stands. The noise is that of the matches and a jitter of stamps, which is learned too. What no offset and
/// scale within the bounds explains (slip, a robot that is carried, a match gone wrong) is left out; the rest
/// has Cauchy's weight.
///
/// Never allocates after construction. Deterministic.
class OnlineOdometryCalibration {
 public:
  static constexpr double kMaxOffset = 0.3;  ///< s
  static constexpr double kMaxScale = 0.15;  ///< of a scale from 1

  OnlineOdometryCalibration();

  /// A sample before this correction; backward stamps are ignored.
  void add(const Odometry& odometry);
  /// A matched scan. `covariance`: x, y, yaw, map frame.
  void add(SensorTime stamp, const Pose2& T_map_base, const Eigen::Matrix3d& covariance);
  /// The clock restarted, or the robot was moved in the map.
  void forget_motion();

  /// translation_scale, rotation_scale and time_offset, to be applied as they are; curvature is 0.
  OdometryCorrection estimate() const;
  /// s, 1 sigma of a stamp; 0 until enough steps were seen.
  double jitter() const;
  /// 1 sigma: s, and of the two scales.
  Eigen::Vector3d sigma() const { return P_.diagonal().cwiseSqrt(); }

 private:
  struct MatchedScan {
    SensorTime stamp;
    Pose2 T_map_base;
    Eigen::Matrix3d covariance;
  };
  /// Motion along the robot and about z over one step: m and rad.
  struct Step {
    double seconds = 0;
    Eigen::Vector2d scans, scans_variance, odometry, by_offset;
  };
  void use_waiting_scans();
  bool is_covered(SensorTime stamp) const;
  std::optional<Step> step_between(const MatchedScan& a, const MatchedScan& b) const;
  std::optional<Eigen::Vector2d> odometry_step(SensorTime a, SensorTime b, double offset) const;
  void use(const Step& step);
  void use_axis(const Step& step, int axis);

  OdometryTrack odometry_;
  Ring<MatchedScan> scans_;
  std::size_t waiting_ = 0;  ///< newest scans that odometry has not reached yet
  std::optional<MatchedScan> before_;
  Eigen::Vector3d x_;  ///< offset, s, and the scales less 1
  Eigen::Matrix3d P_;
  int steps_ = 0;           ///< used so far
  Eigen::Vector2d jitter_;  ///< s^2, mean squares of what is left, per square of the speed
};

/// Applies an estimate to the samples of odometry as they come; without one, they pass unchanged. Steps are
/// scaled, so that the path has no jump, and the time offset changes by at most 2 % of the time that passes,
/// so that stamps stay in order.
class FollowedCorrection {
 public:
  Odometry operator()(const Odometry& odometry, const OdometryCorrection& estimate);
  void forget() { last_.reset(); }
  double time_offset() const { return offset_; }  ///< s, as applied

 private:
  struct Last {
    SensorTime stamp;
    Pose2 raw, corrected;  ///< T_odom_base
  };
  std::optional<Last> last_;
  double offset_ = 0;
  bool unchanged_ = true;
};

}  // namespace parhelion::pose
