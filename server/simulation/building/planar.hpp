// Convex shapes in the floor plane and their motion along arcs: used for placement, clearance and steering.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "protocols/convex_hull.hpp"
#include "protocols/frames.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::simulation {

/// Pose of a robot, or of a body.
template <class Frame>
Pose2 planar_pose(const Transform<Map, Frame>& T_map_frame) {
  return planar(T_map_frame);
}

/// The pose after moving for `t` seconds with constant body twist: an arc of constant curvature (exponential
/// of se(2)).
Pose2 advance(const Pose2& pose, const Twist2& twist, double t);

/// A convex hull of `vertices` (counter-clockwise; one: a point, two: a segment) grown by `radius`, m.
struct Footprint {
  std::vector<Eigen::Vector2d> vertices;
  double radius = 0;
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  ///< of a circle that contains the whole footprint...
  double bound = 0;                                  ///< ...and that circle's radius

  /// Computes center and bound.
  void update_bound();
};

Footprint make_disc(const Eigen::Vector2d& center, double radius);
Footprint make_segment(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double radius);
/// Full lengths, centred on the origin.
Footprint make_rectangle(double length, double width);
Footprint make_polygon(std::vector<Eigen::Vector2d> vertices);

/// `local` moved to `pose`; `placed` keeps its capacity.
void place(const Footprint& local, const Pose2& pose, Footprint& placed);

/// Distance between two footprints, m; if they overlap, minus the smallest translation that separates them
/// (separating axes).
double signed_distance(const Footprint& a, const Footprint& b);
/// A lower bound of signed_distance(), within a factor of sqrt(2) of it, in half the time.
double separation(const Footprint& a, const Footprint& b);
/// The point of b's outline (without its radius) that is nearest to a.
Eigen::Vector2d nearest_point(const Footprint& a, const Footprint& b);
/// A cheap lower bound of signed_distance(): one square root.
inline double distance_bound(const Footprint& a, const Footprint& b) {
  return (a.center - b.center).norm() - a.bound - b.bound;
}

/// Speed of the fastest point of `local` (m/s) under `twist` in its own frame.
double fastest_point_speed(const Footprint& local, const Twist2& twist);

}  // namespace parhelion::simulation
