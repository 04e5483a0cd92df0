#include "fusion/pose/matching/scan_directions.hpp"

#include <algorithm>

namespace parhelion::pose {
namespace {

constexpr double kNear = 0.08, kFar = 0.5;  ///< m, of a neighbour: beyond the noise, on the same surface
constexpr int kMaxBeams = 12;               ///< to that neighbour
constexpr double kStraight = 0.94;          ///< cosine between the two sides
/// The same of adjacent beams, which meet a wall far ahead at a grazing angle: far apart, but in line.
constexpr double kStraightGrazing = 0.99;
/// m, beside the line of two others on one side: a wall across, behind the last of them, is farther from it.
constexpr double kBeside = 0.15;

/// To the nearest neighbour on one side that is far enough; zero: none.
Eigen::Vector2d to_neighbour(std::span<const Eigen::Vector2d> points, std::size_t i, int side) {
  for (int k = 1; k <= kMaxBeams; ++k) {
    const std::size_t at = i + static_cast<std::size_t>(side * k);  // wraps below zero: not in the scan
    if (at >= points.size()) break;
    const Eigen::Vector2d to = points[at] - points[i];
    const double squared = to.squaredNorm();
    if (squared > kFar * kFar) break;
    if (squared >= kNear * kNear) return to;
  }
  return Eigen::Vector2d::Zero();
}

bool are_far_apart(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::max(a.squaredNorm(), b.squaredNorm()) >= kFar * kFar;
}

bool is_straight(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.dot(b) >= kStraightGrazing * a.norm() * b.norm();
}

/// By the neighbours on both sides, or by two on one side.
ScanDirection grazing_direction(std::span<const Eigen::Vector2d> points, std::size_t i) {
  const Eigen::Vector2d& p = points[i];
  if (i >= 1 && i + 1 < points.size()) {
    const Eigen::Vector2d a = p - points[i - 1], b = points[i + 1] - p;
    if (are_far_apart(a, b) && is_straight(a, b)) return {(a + b).normalized(), true};
  }
  for (const int side : {-1, 1}) {
    const std::size_t near = i + static_cast<std::size_t>(side), far = near + static_cast<std::size_t>(side);
    if (near >= points.size() || far >= points.size()) continue;  // wraps below zero
    const Eigen::Vector2d a = points[near] - points[far], b = p - points[near];
    if (!are_far_apart(a, b) || !is_straight(a, b)) continue;
    if (std::abs(a.x() * b.y() - a.y() * b.x()) <= kBeside * a.norm()) return {(a + b).normalized(), true};
  }
  return {};
}

}  // namespace

void assign_directions(std::span<const Eigen::Vector2d> points, std::vector<ScanDirection>& directions) {
  directions.assign(points.size(), {});
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d before = to_neighbour(points, i, -1), after = to_neighbour(points, i, 1);
    const double norms = before.norm() * after.norm();
    if (norms != 0 && -before.dot(after) >= kStraight * norms)
      directions[i] = {(after - before).normalized(), false};
    else if (norms == 0)
      directions[i] = grazing_direction(points, i);
  }
}

}  // namespace parhelion::pose
