// Finds a robot again that no match near its predicted pose explains: wheels that stand still or turn the
// wrong way, scans that are missing, stamps that jitter.
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "fusion/pose/correlative.hpp"
#include "fusion/pose/scan_match.hpp"
#include "fusion/pose/scan_points.hpp"

namespace parhelion::pose {

/// Half sides of the search: m, rad.
struct WideSearchReach {
  double position = 1.2, yaw = 0.6;
};

/// Correlative search around `T_map_base` in `likelihood`, then the fine match of the best places, without a
/// prior. nullopt: no place explains the scan well, or a second one explains it about as well.
std::optional<Match> wide_search(const CorrelativeMap& likelihood, const SurfelMap& fine,
                                 std::span<const Eigen::Vector2d> points_base, const Pose2& T_map_base,
                                 const WideSearchReach& reach, const MatchOptions& options);

/// The same, as its owner offers it to ScanTracking: `around` is the predicted pose.
using WideSearch = std::function<std::optional<Match>(const ScanPoints& scan, const Pose2& around)>;

}  // namespace parhelion::pose
