// Which motion odometry saw between two scans.
#pragma once

#include <optional>

#include "fusion/pose/odometry_track.hpp"

namespace parhelion::pose {

class ScanOdometry {
 public:
  struct Step {
    Pose2 step;         ///< of the base since the scan before; identity at the first
    Twist2 twist;       ///< at the scan
    bool known = true;  ///< false: odometry says nothing about that instant, `step` is a standstill
  };

  void add(const Odometry& odometry) {
    track_.add(odometry);
    latest_ = odometry;
  }
  /// nullopt before the first odometry. A sample with the scan's own stamp that came just before it is taken
  /// as it is: recordings with stamps that go backwards pair them so, and file order is then the truth.
  std::optional<Step> step_to(SensorTime stamp);

 private:
  OdometryTrack track_{seconds(2), milliseconds(500)};
  std::optional<Odometry> latest_;
  std::optional<Pose2> T_odom_base_;  ///< at the scan before
};

}  // namespace parhelion::pose
