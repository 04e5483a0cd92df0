// Finds a robot again that no match near its predicted pose explains: wheels that stand still or turn the
// wrong way, scans that are missing, stamps that jitter.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>

#include "fusion/pose/matching/correlative.hpp"
#include "fusion/pose/matching/scan_match.hpp"
#include "fusion/pose/matching/scan_points.hpp"

namespace parhelion::pose {

struct WideSearchOptions {
  double reach = 1.2, yaw_reach = 0.6;  ///< m, rad, half sides of the search
  double min_score = 0.25;              ///< of the correlative search
  /// Fraction of the scan's points that the place explains, and lead over the second place: a scan into a
  /// room that was not seen before has little in common with the map.
  double min_explained = 0.35, lead = 0.12;
  /// A place that explains so much needs less of a lead.
  double good = 0.55, lead_of_good = 0.05;
  /// Information of `T_map_base` (x, y, yaw; map frame), where something is known of it: places count by what
  /// they explain, less kPriorWeight per squared sigma from there.
  Eigen::Matrix3d prior = Eigen::Matrix3d::Zero();
  static constexpr double kPriorWeight = 0.01;
};

/// Correlative search around `T_map_base` in `likelihood`, then the fine match of the best places. nullopt:
/// no place explains the scan well, or a second one explains it about as well.
std::optional<Match> wide_search(const CorrelativeMap& likelihood, const SurfelMap& fine,
                                 std::span<const Eigen::Vector2d> points_base, const Pose2& T_map_base,
                                 const WideSearchOptions& wide, const MatchOptions& options);

/// The same, as its owner offers it to ScanTracking: `around` is the predicted pose.
using WideSearch = std::function<std::optional<Match>(const ScanPoints& scan, const Pose2& around)>;

}  // namespace parhelion::pose
