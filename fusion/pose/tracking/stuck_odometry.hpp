// Notices odometry that has stood still from the start while the robot drives off.
#pragma once

#include <limits>
#include <optional>
#include <span>

#include "fusion/pose/matching/scan_match.hpp"
#include "fusion/pose/matching/surfel_map.hpp"
#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// Nothing has confirmed yet that odometry works. A robot that drives off fast leaves the reach of matches
/// that are made around the place where odometry holds it; then its scans fit worse and worse there. So these
/// scans are matched ahead and behind, too. Odometry that is right is hardly ever contradicted this way:
/// while it stands, the robot does, unless it is carried. Odometry that only turns counts as odometry that
/// works.
class StuckOdometry {
 public:
  /// Each sample, also before the first scan and while the robot is searched for.
  void add(const Odometry& odometry);
  /// The robot was moved in the map: costs of the place before say nothing of the new one.
  void forget_place();
  /// Scans have shown that the robot has moved, and odometry is still near the place where it began.
  bool is_stuck() const { return stuck_ && !has_moved_; }
  /// A scan's match where odometry has never moved and the points show the robot at another place: it
  /// explains the scan at clearly less cost, and is away by more than the points' error. From then on it is
  /// stuck. `before`: where the robot was at the previous scan; `standing`: the match with odometry's prior;
  /// `prior`: of the new match, about where it begins.
  std::optional<Match> moved_off(const SurfelMap& map, std::span<const Eigen::Vector2d> points_base,
                                 const Pose2& before, const Match& standing, const Eigen::Matrix3d& prior,
                                 const MatchOptions& options);

 private:
  std::optional<Pose2> first_;                                      ///< T_odom_base
  double standing_cost_ = std::numeric_limits<double>::infinity();  ///< of a point, lowest so far
  bool has_moved_ = false, stuck_ = false;
};

}  // namespace parhelion::pose
