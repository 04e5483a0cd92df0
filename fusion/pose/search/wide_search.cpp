#include "fusion/pose/search/wide_search.hpp"

#include <algorithm>

namespace parhelion::pose {
namespace {

constexpr std::size_t kPoints = 120;  ///< of the scan, for the search
constexpr std::size_t kCandidates = 4;
constexpr double kSame = 0.2, kSameYaw = 0.1;  ///< m, rad: two candidates that ended in one place

}  // namespace

std::optional<Match> wide_search(const CorrelativeMap& likelihood, const SurfelMap& fine,
                                 std::span<const Eigen::Vector2d> points_base, const Pose2& T_map_base,
                                 const WideSearchOptions& wide, const MatchOptions& options) {
  const auto candidates =
      likelihood.search(thinned(points_base, kPoints), {T_map_base, wide.reach, wide.reach, wide.yaw_reach},
                        {wide.min_score, kCandidates, 0.5, 0.3});
  Match best;
  double best_score = 0, second = 0;
  for (const CorrelativeMap::Candidate& candidate : candidates) {
    const Pose2& at = candidate.T_map_base;
    const Match found = match(fine, points_base, at, T_map_base, wide.prior, options);
    const Pose2 apart = best.T_map_base.inverse() * found.T_map_base;
    const bool same = best.points > 0 && apart.position().norm() < kSame && std::abs(apart.yaw) < kSameYaw;
    const Eigen::Vector3d off(found.T_map_base.x - T_map_base.x, found.T_map_base.y - T_map_base.y,
                              wrap_angle(found.T_map_base.yaw - T_map_base.yaw));
    const double score = found.explained - WideSearchOptions::kPriorWeight * off.dot(wide.prior * off);
    if (!same) second = std::max(second, std::min(best_score, score));
    if (best.points > 0 && score <= best_score) continue;
    best = found;
    best_score = score;
  }
  const double lead = best.explained < wide.good ? wide.lead : wide.lead_of_good;
  if (best.explained < wide.min_explained || best_score - second < lead) return std::nullopt;
  return best;
}

}  // namespace parhelion::pose
