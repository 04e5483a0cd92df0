// The motion between two scans according to odometry.
#pragma once

#include <optional>

#include "fusion/pose/matching/sweep_motion.hpp"
#include "fusion/pose/odometry/odometry_correction.hpp"
#include "fusion/pose/tracks/attitude_track.hpp"
#include "fusion/pose/tracks/odometry_track.hpp"
#include "protocols/scan.hpp"

namespace parhelion::pose {

class ScanOdometry {
 public:
  struct Step {
    Pose2 step;         ///< of the base since the previous scan; identity at the first
    Pose2 reported;     ///< `step` before a scale that scans have shown was applied to it
    Twist2 twist;       ///< at the scan
    SweepMotion sweep;  ///< at that twist; during a long sweep as odometry went meanwhile, if it has arrived
    bool known = true;  ///< false: odometry has no sample for that instant, `step` is identity
  };

  /// `exists`: false where the robot reports none, so that no step is known.
  explicit ScanOdometry(const OdometryCorrection& correction = {}, bool exists = true)
      : corrected_(correction), exists_(exists) {}

  /// The sample as it is used: corrected.
  const Odometry& add(const Odometry& odometry) {
    latest_ = corrected_(odometry);
    track_.add(*latest_);
    return *latest_;
  }
  /// nullopt before the first odometry, if there is any. A sample with the scan's own stamp that arrived just
  /// before it is used directly: in recordings with stamps that go backwards, file order is correct.
  /// `attitude`: of the base at the scan, where it is measured; wheels measure the way along a slope.
  std::optional<Step> step_to(SensorTime stamp, const std::optional<Attitude>& attitude = {}) {
    return step_to(stamp, {}, {}, attitude);
  }
  /// The same for a scan of `laser`.
  std::optional<Step> step_to(const Scan& scan, const LaserDescription& laser,
                              const std::optional<Attitude>& attitude = {});

 private:
  std::optional<Step> step_to(SensorTime stamp, Duration first_beam, Duration last_beam,
                              const std::optional<Attitude>& attitude);
  std::optional<SweepMotion> during(SensorTime stamp, Duration first_beam, Duration last_beam) const;

  CorrectedOdometry corrected_;
  bool exists_;
  OdometryTrack track_{seconds(2), milliseconds(500)};
  std::optional<Odometry> latest_;
  std::optional<Pose2> T_odom_base_;  ///< at the previous scan
};

}  // namespace parhelion::pose
