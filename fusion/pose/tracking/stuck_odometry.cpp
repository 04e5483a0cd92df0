#include "fusion/pose/tracking/stuck_odometry.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include "fusion/pose/matching/scan_points.hpp"

namespace parhelion::pose {
namespace {

/// m, rad: beyond this odometry has moved, and more than noise. A robot has left its place beyond it, too.
constexpr double kSame = 0.04, kSameYaw = 0.03;
/// m, ahead and behind: starts of matches. At the larger ones the robot has driven on for some scans, along a
/// stretch where they do not show it.
constexpr double kStarts[] = {0.1, 0.2, 0.4, 0.8, 1.2, 1.6, 2.0};
/// Part of the cost of standing, and cost, by which it is clearly less; and sigmas by the points.
constexpr double kLess = 0.8, kLessCost = 3, kSigmas = 3;
constexpr double kExplained = 0.55;  ///< points of a match that shows where the robot is
/// Explained points, as many as searches use. Scans of fewer, as of a laser that sees 4 m, do not hold a
/// robot without odometry: they would follow it to a wrong place, and without them it is lost.
constexpr int kPoints = 120;

/// m, 1 sigma by the points of a match, along the line to another place.
double sigma_towards(const Match& found, const Eigen::Vector2d& apart) {
  const Eigen::Vector2d along = apart.normalized();
  const Eigen::Matrix3d covariance = (found.information + 1e-3 * Eigen::Matrix3d::Identity()).inverse();
  return std::sqrt(along.dot(covariance.topLeftCorner<2, 2>() * along));
}

/// Of the places ahead and behind: those from which a few of the points fit best after a few iterations.
std::array<Pose2, 3> best_starts(const SurfelMap& map, std::span<const Eigen::Vector2d> points_base,
                                 const Pose2& before, const Eigen::Matrix3d& prior,
                                 const MatchOptions& options) {
  struct Begun {
    double cost;
    Pose2 start;
  };
  std::array<Begun, 2 * std::size(kStarts)> begun;
  MatchOptions brief = options;
  brief.iterations = 3;
  const std::vector<Eigen::Vector2d> few = thinned(points_base, kPoints);
  std::size_t count = 0;
  for (const double along : kStarts) {
    for (const double sign : {1.0, -1.0}) {
      const Pose2 start = before * Pose2{sign * along, 0, 0};
      begun[count++] = {match(map, few, start, start, prior, brief).cost, start};
    }
  }
  std::stable_sort(begun.begin(), begun.end(),
                   [](const Begun& a, const Begun& b) { return a.cost < b.cost; });
  return {begun[0].start, begun[1].start, begun[2].start};
}

}  // namespace

void StuckOdometry::add(const Odometry& odometry) {
  const Pose2 pose = planar(odometry.T_odom_base);
  if (has_moved_ || !pose.finite()) return;
  if (!first_) first_ = pose;
  const Pose2 moved = first_->inverse() * pose;
  has_moved_ = moved.position().norm() > kSame || std::abs(moved.yaw) > kSameYaw;
}

void StuckOdometry::forget_place() { standing_cost_ = std::numeric_limits<double>::infinity(); }

std::optional<Match> StuckOdometry::moved_off(const SurfelMap& map,
                                              std::span<const Eigen::Vector2d> points_base,
                                              const Pose2& before, const Match& standing,
                                              const Eigen::Matrix3d& prior, const MatchOptions& options) {
  const auto points = static_cast<double>(points_base.size());
  if (has_moved_ || points < kPoints) return std::nullopt;
  standing_cost_ = std::min(standing_cost_, standing.cost / points);
  // No place costs much less than one where the robot stood.
  if (standing.cost < points * standing_cost_ + kLessCost) return std::nullopt;
  Match best = standing;
  for (const Pose2& start : best_starts(map, points_base, before, prior, options)) {
    const Match found = match(map, points_base, start, start, prior, options);
    if (found.cost < best.cost) best = found;
  }
  if (best.points < kPoints || best.explained < kExplained ||
      best.cost > std::min(kLess * standing.cost, standing.cost - kLessCost))
    return std::nullopt;
  const Eigen::Vector2d apart = best.T_map_base.position() - before.position();
  const bool away = apart.norm() > kSame && apart.norm() > kSigmas * sigma_towards(best, apart);
  const bool turned = std::abs(wrap_angle(best.T_map_base.yaw - before.yaw)) > kSameYaw;
  if (!away && !turned) return std::nullopt;
  stuck_ = true;
  return best;
}

}  // namespace parhelion::pose
