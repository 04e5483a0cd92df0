// What scans show of the scale of odometry's way, for the parts of a drive where scans show no way.
#pragma once

#include <Eigen/Core>

#include "fusion/pose/odometry/online_odometry_calibration.hpp"
#include "fusion/pose/odometry/scan_odometry.hpp"

namespace parhelion::pose {

/// Learned as in online_odometry_calibration.hpp, from matches whose points alone determine the pose: along a
/// bare corridor a match repeats what odometry predicted, and shows nothing. Deterministic.
class OdometryScale {
 public:
  /// `sigma`: error of the way as a fraction, 1 sigma, from the robot's description. It holds until scans
  /// have shown more.
  explicit OdometryScale(double sigma) : described_sigma_(sigma), first_sigma_(calibration_.sigma()[1]) {}

  void add(const Odometry& odometry) { calibration_.add(odometry); }
  /// `T_map_base` at a scan, and the information that its points gave about x, y, yaw (map frame).
  void add(SensorTime stamp, const Pose2& T_map_base, const Eigen::Matrix3d& information);
  /// The pose jumps, or scans and odometry contradict each other: no motion leads over this.
  void forget_motion() { calibration_.forget_motion(); }

  /// Distance driven per distance by odometry.
  double scale() const { return calibration_.estimate().translation_scale; }
  double sigma() const;  ///< 1 sigma, of scale(); at most what the description states
  /// 1 sigma, as a fraction, of a tracked distance that scans do not determine, with what matches add to it;
  /// at most the description's value.
  double tracked_sigma() const;
  /// s, to add to odometry's stamps, and 1 sigma of it; not applied.
  double time_offset() const { return calibration_.estimate().time_offset; }
  double time_offset_sigma() const { return calibration_.sigma()[0]; }
  /// Weight, 0 to 1, of the distance by odometry in its mean with the tracked distance, by the variances of
  /// both.
  double weight() const;
  /// The step with the scale applied.
  ScanOdometry::Step applied(const ScanOdometry::Step& reported) const;

 private:
  OnlineOdometryCalibration calibration_;
  double described_sigma_;
  double first_sigma_;  ///< of the calibration, before it has seen anything
};

}  // namespace parhelion::pose
