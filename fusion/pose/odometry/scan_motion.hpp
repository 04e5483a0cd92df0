// The robot's motion as matched scans show it, for robots whose odometry is worse than that: stamps that
// jitter, wheels that slip. Velocity is taken as constant between scans.
#pragma once

#include <optional>

#include "protocols/pose2.hpp"
#include "protocols/time.hpp"

namespace parhelion::pose {

/// Never allocates.
class ScanMotion {
 public:
  /// A matched scan. `by_odometry`: its pose as odometry predicted it from the scan before.
  void add(SensorTime stamp, const Pose2& T_map_base, const std::optional<Pose2>& by_odometry);
  void forget() { *this = {}; }
  /// The pose in the map was corrected; the robot's motion is unchanged.
  void correct(const Pose2& T_map_map) { last_ = T_map_map * last_; }

  /// Whether constant velocity has predicted the last scans clearly better than odometry.
  bool is_preferred() const { return preferred_; }

  /// The last matched scan, and the mean twist of the step that led to it.
  struct Step {
    SensorTime stamp;
    Pose2 T_map_base;
    Twist2 twist;        ///< body frame
    double seconds = 0;  ///< of the step
  };
  std::optional<Step> last_step() const;

  struct Prediction {
    Pose2 step;    ///< from the last scan's pose, in its frame
    Twist2 twist;  ///< body frame
    double position_variance = 0,
           yaw_variance = 0;  ///< m^2 along one axis, rad^2: of the motion since the scan
  };
  /// From the last scan; within half a second of it.
  std::optional<Prediction> at(SensorTime t) const;

 private:
  /// Mean squares of a predictor's errors over about the last 16 scans, per s^2; and relative to the squares
  /// of the speeds, since stamps that jitter do more harm the faster the robot is.
  struct Errors {
    double position = 0, yaw = 0;
    double position_by_speed = 0, yaw_by_speed = 0;
    double at_distance() const;
  };
  void learn(const Pose2& found, const Pose2& predicted, double dt, Errors& errors) const;
  void choose();

  std::optional<SensorTime> stamp_;
  Pose2 last_;
  std::optional<Twist2> twist_;
  double step_ = 0;  ///< s, over which that is the mean
  Errors constant_velocity_, odometry_;
  int learned_ = 0;
  bool preferred_ = false;
};

}  // namespace parhelion::pose
