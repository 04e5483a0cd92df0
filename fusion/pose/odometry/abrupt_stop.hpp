// Notices odometry that stops harder than robots brake: it may have frozen while the robot drives on.
#pragma once

#include <optional>

#include "fusion/pose/tracks/ring.hpp"
#include "protocols/pose.hpp"

namespace parhelion::pose {

/// Tells a robot that stops from odometry that freezes. Both then repeat exactly the same pose. But a robot
/// brakes first, while odometry reports full speed until it freezes. If odometry arrives often enough, the
/// deceleration over the last 0.3 s shows which it was. Afterwards a robot that really stopped accelerates
/// gently.
class AbruptStop {
 public:
  /// In the order of arrival.
  void add(const Odometry& odometry);
  /// Odometry stands still since such a stop, or has moved again for less than 0.3 s.
  bool is_stopped() const { return stopped_; }
  /// The last such stop is over, and odometry went on from a standstill, without a gap: the stop seems to
  /// have been the robot's. Odometry that comes back while the robot stands, or drives slower than some 0.5
  /// m/s, looks the same.
  bool was_true() const { return was_true_; }
  /// m/s, before the stop.
  double speed() const { return speed_; }

 private:
  struct Sample {
    SensorTime stamp;
    double driven = 0;  ///< m
  };
  double deceleration() const;
  void end_after(const Sample& now);

  Ring<Sample> moving_{64};  ///< since odometry last stood still
  std::optional<Odometry> latest_;
  Sample last_;  ///< at `latest_`
  double speed_ = 0;
  bool still_ = false, stopped_ = false, was_true_ = false;
};

}  // namespace parhelion::pose
