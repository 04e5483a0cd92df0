// Scans that contradict the ones before: the laser tilts and sees the floor, the robot is carried, or a crowd
// closes in on it. Nothing can be matched to them, and a map must not be built of them.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "fusion/pose/scan_change.hpp"
#include "fusion/pose/scan_points.hpp"
#include "fusion/pose/scan_tracking.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

class ContradictingScans {
 public:
  enum class Finding : std::uint8_t {
    none,
    changed,  ///< much has changed since the previous scan, for once: somebody came close, or a door opened
    contradicting,
    settled,  ///< no longer: the scans agree with each other again, but not with the map
  };
  /// Contradicting is a scan of which much has changed since the previous one, or since a second, whether the
  /// robot moved as odometry shows, or to where the map matches the scan; and those after it, until the map
  /// explains one as usual, near where the robot is expected, or for a second and 0.8 m none has been
  /// contradicting. The floor in front of a tilted laser moves along with the robot. For ten seconds at most:
  /// then, for ten more, nothing counts as contradicting, lest it be odometry that is wrong. `T_map_before`:
  /// the base at the previous scan. `step`: of odometry since then. `match`: the scan's best match, by
  /// odometry or by scans alone; asked only where it is needed.
  Finding add(const ScanPoints& scan, const Pose2& T_map_before, const Pose2& step,
              const std::function<ScanTracking::Followed()>& match);
  /// It happened twice within the last ten seconds, as on a robot that rocks, whose scans mislead in between,
  /// too; or for so long that nothing counts as contradicting now.
  bool in_doubt(SensorTime now) const;
  /// The fraction of a scan's points that the map explained.
  void learn(double explained);
  /// Nothing is known of the motion from the previous scan to the next.
  void forget();

 private:
  /// A scan of the last second, with the base's poses at it.
  struct Past {
    ScanPoints scan;
    Pose2 T_odom_base, T_map_base;
  };
  void keep_previous(SensorTime now, const Pose2& T_map_before);
  Finding compare(const ScanPoints* before, const ScanPoints& scan, const Pose2& T_map_before,
                  const Pose2& step, const std::function<ScanTracking::Followed()>& match);
  Finding contradicting(const ScanPoints& scan);
  Finding contradiction_goes_on(const ScanPoints& scan, bool much);

  PreviousScan previous_;
  bool changed_ = false;            ///< it had changed much, for once
  std::deque<Past> past_;           ///< oldest first
  Pose2 T_odom_base_;               ///< by the steps so far
  std::optional<ScanPoints> last_;  ///< the last scan that contradicted those before; none: they agree
  Pose2 T_last_now_;                ///< the base's motion since that, by odometry
  double driven_ = 0;               ///< m, the same since the first of them
  std::optional<SensorTime> began_, began_before_;  ///< stamps of the first ones of the last two times
  SensorTime tolerated_until_;                      ///< before that nothing counts as contradicting
  double usual_ = 0;                                ///< explained fraction
};

}  // namespace parhelion::pose
