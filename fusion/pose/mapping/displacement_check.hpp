// Notices that a robot was picked up while it makes a map: its scans contradict the newest part of the map,
// both by what they see in free space and by what they see through, and the map explains less of them than
// usual. People and doors cause the one or the other; what is new, as a room that the robot enters, neither.
#pragma once

#include <optional>

#include "fusion/pose/matching/scan_points.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// Needs two scans a second at least.
class DisplacementCheck {
 public:
  /// From the base of the newest keyframe to that of the scan: as its match shows it, and as odometry
  /// predicts it. Close to a surface a small error of either looks like a large change.
  struct Motions {
    Pose2 tracked, predicted;
  };
  /// After each scan. `keyframe`: the newest scan of the map. `explained`: fraction of the points of `scan`
  /// that the map explains.
  void add(const ScanPoints& keyframe, const ScanPoints& scan, const Motions& T_keyframe_base,
           double explained);
  /// The robot was found again.
  void forget() {
    suspected_ = false;
    contradictions_ = 0;
  }

  /// The last scan contradicts the map: people may surround the robot, or it was picked up.
  bool is_suspected() const { return suspected_; }
  /// The previous scan contradicted it, too, and much that stood in the map is gone: people cannot cause
  /// that.
  bool is_displaced() const { return contradictions_ > 1; }
  /// Fraction of the points of a scan that the map explains.
  double usually_explained() const { return usual_; }

 private:
  double usual_ = 0;
  int scans_ = 0;
  std::optional<SensorTime> before_;  ///< stamp of the previous scan
  double interval_ = 0;               ///< s, the usual one between scans
  bool suspected_ = false;
  int contradictions_ = 0;  ///< scans, one after the other, for which things have vanished, too
};

}  // namespace parhelion::pose
