// The shape of a segment of returns.
#pragma once

#include <Eigen/Core>
#include <span>

namespace parhelion::people {

struct Return;

struct SegmentShape {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  ///< m, map: mean of the returns
  double radius = 0;                                 ///< m: largest distance of a return from the centre
  double depth = 0;            ///< m: largest distance from the line of its ends, towards the eye
  double roughness = 0;        ///< m: RMS distance from the best line
  double concavity = 0;        ///< m: largest distance behind the convex hull, as seen from the eye
  double circle_radius = 0;    ///< m, at most 0.5
  double circle_residual = 0;  ///< m: RMS distance from the best circle
};

/// `eye`: m, map: where the laser was.
SegmentShape shape_of(std::span<const Return> returns, const Eigen::Vector2d& eye);

}  // namespace parhelion::people
