// Roll and pitch at any instant, from an inertial sensor: SLAM in the plane knows neither.
#pragma once

#include <optional>

#include "fusion/pose/ring.hpp"
#include "protocols/joints.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

/// Of base_link against the vertical: R = Rz(yaw) Ry(pitch) Rx(roll), rad (REP-103).
struct Attitude {
  double roll = 0;
  double pitch = 0;
};

/// `T_map_base` with its roll and pitch replaced; place and heading stay.
Transform<Map, Base> with_attitude(const Transform<Map, Base>& T_map_base, const Attitude& attitude);

/// A fixed-size history; adding never allocates. Without an `imu` in the robot description the mounting is
/// not known, and neither is any attitude.
class AttitudeTrack {
 public:
  explicit AttitudeTrack(const std::optional<ImuDescription>& imu);

  /// False: nothing to learn from it: no mounting, no orientation, a backward stamp, or a robot that stands
  /// on its nose (pitch beyond 80 degrees has no roll and no heading). A stamp that jumps back by more than
  /// two seconds is a new start of the sensor's clock.
  bool add(const ImuSample& sample);
  /// Between two samples at most `longest_gap` apart, or at most that after the newest. None: not known,
  /// which is not level.
  std::optional<Attitude> at(SensorTime t) const;

  static constexpr Duration longest_gap = milliseconds(200);

 private:
  struct Sample {
    SensorTime stamp;
    Attitude attitude;
  };
  std::optional<Eigen::Quaterniond> R_imu_base_;
  Ring<Sample> samples_;
};

}  // namespace parhelion::pose
