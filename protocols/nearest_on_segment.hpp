// The point of a line segment that is nearest to another point.
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace parhelion {

/// In one frame and unit; `a` where both ends are one point.
inline Eigen::Vector2d nearest_on_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a,
                                          const Eigen::Vector2d& b) {
  const Eigen::Vector2d ab = b - a;
  const double length2 = ab.squaredNorm();
  const double s = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return a + s * ab;
}

}  // namespace parhelion
