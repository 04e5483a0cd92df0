// Reasons to doubt a pose that matches the map: a robot that was picked up and put down in a place that looks
// much like the one before, or is being carried.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "fusion/pose/scan_odometry.hpp"
#include "fusion/pose/scan_points.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// What two scans contradict each other in, as fractions of the returns that could be compared: those of the
/// first that lie where the second sees through, and those of the second where the first did. What one of
/// them cannot see, because something is in front of it, is no contradiction.
struct ScanChange {
  double vanished = 0, appeared = 0;
  bool known = false;  ///< enough returns could be compared
};
/// `T_before_now`: the base's motion between both.
ScanChange change_between(const ScanPoints& before, const ScanPoints& now, const Pose2& T_before_now);

class PoseDoubt {
 public:
  /// After each scan. `T_map_before`: the pose at the previous one. `of_usual`: what the map explains of this
  /// scan, as a fraction of what it usually explains.
  void add(const ScanPoints& scan, const Pose2& T_map_before, const Pose2& T_map_now,
           const ScanOdometry::Step& odometry, double of_usual);
  /// The pose was set anew.
  void forget();

  /// From the previous scan to this one, everything around has changed: people who come and go do not explain
  /// it, and neither does the motion that the match or odometry shows.
  bool displaced() const { return displaced_; }
  /// Within the last second, the scans have shown a motion that odometry has not.
  bool moved_otherwise() const;
  /// The same, and the wheels stand still, or nothing is known of them.
  bool carried() const;

 private:
  std::optional<ScanPoints> previous_;
  bool displaced_ = false;
  double interval_ = 0;                                    ///< s, the usual one between scans
  Eigen::Vector2d unexplained_ = Eigen::Vector2d::Zero();  ///< m, of the motion of the last second, map frame
  double unexplained_yaw_ = 0;                             ///< rad, the same
  double driven_ = 0, turned_ = 0;                         ///< m, rad, by odometry, in that time
  double just_driven_ = 0;                                 ///< m and rad, by odometry, of the last moments
  bool still_ = false;
  std::optional<SensorTime> moved_otherwise_;  ///< the last scan at which that was much
};

}  // namespace parhelion::pose
