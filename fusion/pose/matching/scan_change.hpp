// What has changed around the robot between two scans.
#pragma once

#include <optional>

#include "fusion/pose/matching/scan_points.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// What two scans contradict each other in, as fractions of the returns that could be compared: those of the
/// first that lie where the second sees through, and those of the second where the first did. What one of
/// them cannot see, because something is in front of it, is no contradiction.
struct ScanChange {
  double vanished = 0, appeared = 0;
  bool known = false;  ///< enough returns could be compared

  bool exceeds(double fraction) const { return known && vanished + appeared > fraction; }
};
/// `T_before_now`: the base's motion between both.
ScanChange change_between(const ScanPoints& before, const ScanPoints& now, const Pose2& T_before_now);

/// The previous scan, kept for comparison with the next.
class PreviousScan {
 public:
  void set(const ScanPoints& scan);
  void forget();
  const std::optional<ScanPoints>& scan() const { return scan_; }
  /// s from it to `now`; 0 where there is none.
  double seconds_until(SensorTime now) const;
  /// Null where it does not compare with a scan at `now`: much more time has passed than usual, so that the
  /// motion is not known well enough, or time has gone back.
  const ScanPoints* comparable(SensorTime now) const;

 private:
  std::optional<ScanPoints> scan_;
  double interval_ = 0;  ///< s, the usual one between scans
};

}  // namespace parhelion::pose
