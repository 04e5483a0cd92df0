// Notices odometry that froze where scans show how the robot turns, but not how far it drives.
#pragma once

#include <optional>

#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// In a corridor without features, scans do not show that a robot drives on while its odometry is frozen. But
/// no robot drives quite straight: if odometry has been exactly constant, for at most three seconds, and most
/// scans have turned since, odometry froze.
class FrozenOdometry {
 public:
  /// What scans showed up to the previous one.
  struct Motion {
    Pose2 T_map_base;
    Pose2 step;             ///< from one scan to the next
    double interval = 0.1;  ///< s between scans
  };
  /// At each scan. `step`: of odometry since the previous one. `intervals`: as many times the usual interval
  /// has passed since then.
  void add(const Pose2& step, const Motion& before, double intervals);
  /// The same scan's yaw in the map, as its match shows it. True where this is the first to show that
  /// odometry froze.
  bool add_match(double yaw);
  void forget() { still_.reset(); }

  /// Until odometry moves.
  bool is_frozen() const { return still_ && still_->frozen; }
  /// Scans have since turned as much again, for more than a second, so it is no error of a single match.
  bool is_certain() const;
  /// Only while odometry stands still: where the robot is at the scan if it has driven on since, by `step`
  /// from one scan to the next; 1 sigma of its position, m.
  Pose2 driven_on() const;
  double sigma() const;
  const Pose2& step() const { return still_->before.step; }

 private:
  struct Still {
    Motion before;
    double intervals = 0;                      ///< since then
    int matches = 0, turning = 0;              ///< all, and those that turned since the one before
    double turn = 0, lowest = 0, highest = 0;  ///< rad, since then: of the last match, and of all
    bool frozen = false;
    double frozen_at = 0;  ///< intervals; the turns are those since then
  };
  std::optional<Still> still_;
};

}  // namespace parhelion::pose
