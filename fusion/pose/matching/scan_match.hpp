// Aligns the points of a scan with a surfel map: Gauss-Newton on point-to-line distances (Censi 2008) with
// robust weights and the pose predicted by odometry as prior (an iterated extended Kalman update).
#pragma once

#include <Eigen/Core>
#include <span>

#include "fusion/pose/matching/surfel_map.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

struct MatchOptions {
  int iterations = 12;
  double range_sigma = 0.01;  ///< m, 1 sigma about the surface, in addition to the surfel's thickness
  double gate = 0.3;          ///< m, points farther from their surfel are ignored
  double inlier = 0.1;        ///< m, counts as explained
  /// Points on a line say nothing along it, and nothing of surfaces that cross it (Pulli 1999, "Multiview
  /// registration for large data sets"; Segal et al. 2009, "Generalized-ICP"). Without this, the leaf of a
  /// door that was open when the map was made is drawn to its hinges. Needs points in the order of the beams.
  bool by_direction = false;
  /// For a map that grows with the scans that are matched to it. It ends where no scan has seen farther, so
  /// that points beyond would be pulled back to its edge. Its normals have the noise of few points, so that a
  /// straight wall seems to determine the position along it. With this option points past the edge do not
  /// count, and if only walls of one direction are seen, their normals count as equal.
  bool growing = false;
};

struct Match {
  Pose2 T_map_base;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< x, y, yaw in the map frame, of the points alone
  double explained = 0;  ///< fraction of all points that lie within `inlier` of a surfel
  double rms = 0;        ///< m, of those
  double cost = 0;       ///< minimised: robust cost of all points and of the distance from `expected`
  int points = 0;        ///< number of explained points
};

/// `expected` with information `prior` (x, y, yaw in the map frame; zero: none).
Match match(const SurfelMap& map, std::span<const Eigen::Vector2d> points_base, const Pose2& start,
            const Pose2& expected, const Eigen::Matrix3d& prior, const MatchOptions& options);

/// As match(), but from several starts where a single one is in doubt: from `coarse` (larger cells, wider
/// basin of convergence), and from positions along the path and headings around it, in case odometry's stamp
/// or heading was wrong. The result with the lowest cost is returned.
Match match_from_several(const SurfelMap& fine, const SurfelMap& coarse,
                         std::span<const Eigen::Vector2d> points_base, const Pose2& expected,
                         const Eigen::Matrix3d& prior, const MatchOptions& options);
/// The same; never allocates. `few`: some 120 of the points, spread evenly, for the search.
Match match_from_several(const SurfelMap& fine, const SurfelMap& coarse,
                         std::span<const Eigen::Vector2d> points_base, std::span<const Eigen::Vector2d> few,
                         const Pose2& expected, const Eigen::Matrix3d& prior, const MatchOptions& options);

}  // namespace parhelion::pose
