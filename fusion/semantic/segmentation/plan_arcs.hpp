// Round walls: arcs of the plan that replace the many lines that touch them. Internal to this module.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <vector>

#include "fusion/semantic/segmentation/line_refiner.hpp"
#include "fusion/semantic/segmentation/plan_blocks.hpp"

namespace parhelion::semantic {

struct PlanArc {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< m
  double radius = 1;                                 ///< m
  double middle = 0;                                 ///< rad, direction from the centre
  double low = 0, high = 0;                          ///< m along the arc from the middle, counter-clockwise
  double across(const Eigen::Vector2d& q) const { return (q - centre).norm() - radius; }
  double along(const Eigen::Vector2d& q) const {
    const Eigen::Vector2d d = q - centre;
    return radius * std::remainder(std::atan2(d.y(), d.x()) - middle, 2 * std::numbers::pi);
  }
  Eigen::Vector2d at(double s) const {
    const double angle = middle + s / radius;
    return centre + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
};

/// Arcs that describe the evidence of two or more lines with fewer parameters; these lines are removed from
/// `lines`. Circles through pairs of lines that may be chords of one are fitted to the evidence by least
/// squares of distances (Gauss-Newton, biweight from wide to narrow) and compared with the lines by the
/// Bayesian information criterion.
std::vector<PlanArc> find_arcs(const PlanBlocks& evidence, double near, double min_length,
                               std::vector<PlanLine>& lines);

/// The corners of a polyline with a distance of at most `near` / 2 from the arc.
std::vector<Eigen::Vector2d> corners_of(const PlanArc& arc, double near);

}  // namespace parhelion::semantic
