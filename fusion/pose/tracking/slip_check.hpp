// Detects a suspected slip along a corridor during tracking: the map explains few points of the scans at the
// estimated pose, and nearly as many as usual a few metres away.
#pragma once

#include <optional>

#include "fusion/pose/maps/frozen_map.hpp"
#include "fusion/pose/matching/scan_match.hpp"
#include "fusion/pose/matching/scan_points.hpp"

namespace parhelion::pose {

class SlipCheck {
 public:
  /// After each scan. `explained`: fraction of its points that the map explains from `T_map_base`; `usual`:
  /// what that is usually. True from where it explains much more from another place nearby until it explains
  /// as much as usual again. A search takes some milliseconds: at most one in two seconds.
  bool add(const FrozenMap& map, const ScanPoints& scan, const Pose2& T_map_base, double explained,
           double usual, const MatchOptions& options);
  void forget() { *this = {}; }

 private:
  int poor_ = 0, good_ = 0;  ///< scans, one after the other
  bool slipped_ = false;
  std::optional<SensorTime> searched_;
};

}  // namespace parhelion::pose
