// The directions of the surfaces that a scan saw.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace parhelion::pose {

/// The line that a point of a scan lies on.
struct ScanDirection {
  Eigen::Vector2d along = Eigen::Vector2d::Zero();  ///< unit; zero: unknown
  /// By points so far apart that it is more certain than the normal of a small piece of surface: of adjacent
  /// beams, which meet a wall far ahead at a grazing angle.
  bool grazing = false;
};

/// For each point, in the order of the beams, the direction of the line that it and its neighbours on both
/// sides lie on; unknown where these are not in line, too far away, or missing: at corners, edges and
/// vegetation. Where adjacent beams are far apart, two neighbours on one side will do.
void assign_directions(std::span<const Eigen::Vector2d> points, std::vector<ScanDirection>& directions);

}  // namespace parhelion::pose
