// Roll and pitch at any instant, from an inertial sensor: planar SLAM estimates neither.
#pragma once

#include <optional>

#include "fusion/pose/tracks/ring.hpp"
#include "protocols/joints.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

/// Attitude of base_link relative to the vertical: R = Rz(yaw) Ry(pitch) Rx(roll), rad (REP-103).
struct Attitude {
  double roll = 0;
  double pitch = 0;
};

/// The laser of a robot that stands on a slope, in a level frame with the same origin and heading.
Transform<Base, Laser> levelled(const Transform<Base, Laser>& T_base_laser, const Attitude& attitude);

/// `T_map_base` with its roll and pitch replaced; position and heading are unchanged.
Transform<Map, Base> with_attitude(const Transform<Map, Base>& T_map_base, const Attitude& attitude);

/// A fixed-size history; adding never allocates. Without an `imu` in the robot description its mounting and
/// the attitude are unknown. Instants are on the clock of the scans: samples are shifted by the description's
/// time offset.
class AttitudeTrack {
 public:
  explicit AttitudeTrack(const std::optional<ImuDescription>& imu);

  /// False: the sample is not used: no mounting, no orientation, a backward stamp, or pitch beyond 80 degrees
  /// (roll and heading are then undefined). A stamp that jumps back by more than two seconds means that the
  /// sensor's clock restarted.
  bool add(const ImuSample& sample);
  /// Interpolated between two samples at most `kLongestGap` apart, or at most that long after the newest.
  /// None: unknown, which does not mean level.
  std::optional<Attitude> at(SensorTime t) const;

  static constexpr Duration kLongestGap = milliseconds(200);

 private:
  struct Sample {
    SensorTime stamp;
    Attitude attitude;
  };
  std::optional<Eigen::Quaterniond> R_imu_base_;
  Duration time_offset_;  ///< added to stamps
  Ring<Sample> samples_;
};

}  // namespace parhelion::pose
