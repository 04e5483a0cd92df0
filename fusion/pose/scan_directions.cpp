#include "fusion/pose/scan_directions.hpp"

#include <algorithm>

namespace parhelion::pose {
namespace {

constexpr double kNear = 0.08, kFar = 0.5;  ///< m, of a neighbour: beyond the noise, on the same surface
constexpr int kMaxBeams = 12;               ///< to that neighbour
constexpr double kStraight = 0.94;          ///< cosine between the two sides
/// The same of adjacent beams, which meet a wall far ahead at a grazing angle: so far apart (m), but in line.
constexpr double kGrazing = 3, kStraightGrazing = 0.99;

/// To the nearest neighbour on one side that is far enough; zero: none.
Eigen::Vector2d to_neighbour(std::span<const Eigen::Vector2d> points, std::size_t i, int side) {
  for (int k = 1; k <= kMaxBeams; ++k) {
    const std::size_t at = i + static_cast<std::size_t>(side * k);  // wraps below zero: not in the scan
    if (at >= points.size()) break;
    const Eigen::Vector2d to = points[at] - points[i];
    const double squared = to.squaredNorm();
    const double far = k == 1 ? kGrazing : kFar;
    if (squared > far * far) break;
    if (squared >= kNear * kNear) return to;
  }
  return Eigen::Vector2d::Zero();
}

}  // namespace

void assign_directions(std::span<const Eigen::Vector2d> points, std::vector<Eigen::Vector2d>& directions) {
  directions.assign(points.size(), Eigen::Vector2d::Zero());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d before = to_neighbour(points, i, -1), after = to_neighbour(points, i, 1);
    const double norms = before.norm() * after.norm();
    const bool grazing = std::max(before.squaredNorm(), after.squaredNorm()) > kFar * kFar;
    if (norms == 0 || -before.dot(after) < (grazing ? kStraightGrazing : kStraight) * norms) continue;
    directions[i] = (after - before).normalized();
  }
}

}  // namespace parhelion::pose
