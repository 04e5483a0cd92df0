#include "protocols/line_in_box.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion {

double line_in_box(const Transform<Map, Body>& T_map_body, const Eigen::Vector3d& size,
                   const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Matrix3d& R = T_map_body.isometry().linear();
  const Eigen::Vector3d center = T_map_body.isometry().translation();
  const Eigen::Vector3d from = R.transpose() * (a - center), segment = R.transpose() * (b - a);
  double enter = 0, leave = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double half = size[axis] / 2;
    if (std::abs(segment[axis]) < 1e-12) {
      if (std::abs(from[axis]) >= half) return 0;
      continue;
    }
    const double s = (-half - from[axis]) / segment[axis], t = (half - from[axis]) / segment[axis];
    enter = std::max(enter, std::min(s, t));
    leave = std::min(leave, std::max(s, t));
  }
  return leave > enter ? (leave - enter) * segment.norm() : 0;
}

}  // namespace parhelion
