// Finds a robot that was picked up while it made a map, in the map so far.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fusion/pose/mapping/slam_front_end.hpp"
#include "fusion/pose/maps/frozen_map.hpp"
#include "fusion/pose/maps/mapped_scan.hpp"
#include "fusion/pose/search/localizer_search.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

/// A keyframe at its pose in a map.
MappedScan mapped(const Keyframe& keyframe, const Pose2& T_map_base, const LaserDescription& laser);

/// When a search begins, a map is made from keyframes some decimetres apart. This takes up to a second in a
/// large building, so the first scan of a search is not searched for, and its answer is not delayed further.
class KeyframeSearch {
 public:
  /// After each scan since then; `step`: of the base since the previous one, by odometry. `usual`: fraction
  /// of a scan that the map usually explains. The pose in the map of the keyframes, once no other place of it
  /// is possible; nullopt before, and where the robot is not in that map.
  std::optional<Pose2> add(std::span<const Keyframe> keyframes, const LaserDescription& laser,
                           const ScanPoints& scan, const Pose2& step, double usual);
  void forget();

 private:
  bool is_certain(const ScanPoints& scan, const Pose2& step, const Pose2& found, double usual);

  bool begun_ = false;
  std::optional<FrozenMap> map_;
  GlobalSearch search_;
  std::optional<Pose2> before_;  ///< what the search found with the previous scan
  double followed_ = 0;          ///< m and rad, that the robot moved while it found the same place
};

}  // namespace parhelion::pose
