// The rectangle of least area around points of a plan. Internal to the objects.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace parhelion::semantic {

struct PlanRectangle {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  double length = 0, width = 0;  ///< m; the width is not the longer one
  double yaw = 0;                ///< rad, of its longer side
};

/// Of yaws 3 degrees apart; a hundredth of the points may lie beyond each side. `cell`: m, size of a point.
/// `points` must not be empty.
PlanRectangle plan_rectangle(const std::vector<Eigen::Vector2d>& points, double cell);

}  // namespace parhelion::semantic
