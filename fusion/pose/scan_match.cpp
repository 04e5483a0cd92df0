#include "fusion/pose/scan_match.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <vector>

#include "fusion/pose/scan_directions.hpp"
#include "fusion/pose/scan_points.hpp"

namespace parhelion::pose {
namespace {

constexpr double kKnee = 9;  ///< chi^2 at which a point has weight 1/4; maximum cost of a point

/// Neighbouring beams share errors of the map and of the laser: they are not independent.
constexpr double kIndependentFraction = 0.1;
constexpr double kCrosses = 0.7;  ///< cosine between a line of points and the normal of a surface

struct NormalEquations {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double squares = 0;
  double cost = 0;  ///< of all points; those without a surfel have the maximum cost
  int explained = 0;
};

/// As assign_directions() gives them, in the frame of the points; empty where they are not asked for.
using Directions = std::span<const Eigen::Vector2d>;

NormalEquations equations(const SurfelMap& map, std::span<const Eigen::Vector2d> points,
                          Directions directions, const Pose2& pose, const MatchOptions& options) {
  NormalEquations sum;
  const double c = std::cos(pose.yaw), s = std::sin(pose.yaw);
  const double noise = options.range_sigma * options.range_sigma;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d& p = points[i];
    const Eigen::Vector2d arm(c * p.x() - s * p.y(), s * p.x() + c * p.y());
    const Eigen::Vector2d q(pose.x + arm.x(), pose.y + arm.y());
    const Surfel* surfel = map.nearest(q);
    sum.cost += kKnee;
    if (surfel == nullptr) continue;
    const Eigen::Vector2d offset = q - surfel->mean;
    Eigen::Vector2d along = Eigen::Vector2d::Zero();
    if (!directions.empty())
      along = {c * directions[i].x() - s * directions[i].y(), s * directions[i].x() + c * directions[i].y()};
    const bool on_line = !along.isZero();
    Eigen::Matrix2d W;
    double distance;
    if (surfel->flat) {
      if (on_line && std::abs(along.dot(surfel->normal)) > kCrosses) continue;
      distance = std::abs(surfel->normal.dot(offset));
      W = surfel->normal * surfel->normal.transpose() / (noise + surfel->thickness * surfel->thickness);
    } else if (on_line) {
      const Eigen::Vector2d normal(-along.y(), along.x());
      distance = offset.norm();
      W = 0.25 * normal * normal.transpose() / (noise + normal.dot(surfel->covariance * normal));
    } else {
      distance = offset.norm();
      W = (surfel->covariance + noise * Eigen::Matrix2d::Identity()).inverse() * 0.25;
    }
    if (distance > options.gate) continue;
    if (distance < options.inlier) {
      ++sum.explained;
      sum.squares += distance * distance;
    }
    // Geman-McClure on the normalised distance: people and moved chairs are down-weighted.
    const double chi2 = offset.dot(W * offset);
    const double robust = kKnee / (kKnee + chi2);
    const double weight = robust * robust;
    sum.cost += chi2 * robust - kKnee;
    Eigen::Matrix<double, 2, 3> J;
    J << 1, 0, -arm.y(), 0, 1, arm.x();
    const Eigen::Matrix<double, 3, 2> JtW = weight * J.transpose() * W;
    sum.H += JtW * J;
    sum.b += JtW * offset;
  }
  sum.cost *= kIndependentFraction;
  sum.H *= kIndependentFraction;
  sum.b *= kIndependentFraction;
  return sum;
}

}  // namespace

Match match(const SurfelMap& map, std::span<const Eigen::Vector2d> points_base, const Pose2& start,
            const Pose2& expected, const Eigen::Matrix3d& prior, const MatchOptions& options) {
  Match result;
  Pose2 pose = start;
  thread_local std::vector<Eigen::Vector2d> directions;
  directions.clear();
  if (options.by_direction) assign_directions(points_base, directions);
  const Eigen::Matrix3d regular = 1e-3 * Eigen::Matrix3d::Identity();
  for (int i = 0; i < options.iterations; ++i) {
    const NormalEquations sum = equations(map, points_base, directions, pose, options);
    const Eigen::Vector3d off(pose.x - expected.x, pose.y - expected.y, wrap_angle(pose.yaw - expected.yaw));
    const Eigen::Vector3d step = (sum.H + prior + regular).ldlt().solve(-(sum.b + prior * off));
    if (!step.allFinite()) break;
    pose = {pose.x + step.x(), pose.y + step.y(), wrap_angle(pose.yaw + step.z())};
    if (step.head<2>().norm() < 1e-4 && std::abs(step.z()) < 2e-5) break;
  }
  const NormalEquations sum = equations(map, points_base, directions, pose, options);
  result.T_map_base = pose;
  result.information = sum.H;
  const Eigen::Vector3d off(pose.x - expected.x, pose.y - expected.y, wrap_angle(pose.yaw - expected.yaw));
  result.cost = sum.cost + off.dot(prior * off);
  result.points = sum.explained;
  result.explained =
      points_base.empty() ? 0 : static_cast<double>(sum.explained) / static_cast<double>(points_base.size());
  result.rms = sum.explained > 0 ? std::sqrt(sum.squares / sum.explained) : 0;
  return result;
}

Match match_from_several(const SurfelMap& fine, const SurfelMap& coarse,
                         std::span<const Eigen::Vector2d> points_base, const Pose2& expected,
                         const Eigen::Matrix3d& prior, const MatchOptions& options) {
  const std::vector<Eigen::Vector2d> few = thinned(points_base, 120);
  return match_from_several(fine, coarse, points_base, few, expected, prior, options);
}

Match match_from_several(const SurfelMap& fine, const SurfelMap& coarse,
                         std::span<const Eigen::Vector2d> points_base, std::span<const Eigen::Vector2d> few,
                         const Pose2& expected, const Eigen::Matrix3d& prior, const MatchOptions& options) {
  const auto better = [](Match a, Match b) { return b.cost < a.cost ? b : a; };
  MatchOptions rough = options;
  rough.iterations = 6;
  rough.gate = coarse.cell();
  rough.range_sigma = fine.cell();
  const Match near = match(coarse, few, expected, expected, prior, rough);
  Match best = better(match(fine, points_base, expected, expected, prior, options),
                      match(fine, points_base, near.T_map_base, expected, prior, options));
  const Pose2 off = expected.inverse() * best.T_map_base;
  constexpr double sure = 0.85;
  if (best.explained > sure && off.position().norm() < fine.cell() && std::abs(off.yaw) < 0.03) return best;
  MatchOptions quick = options;
  quick.iterations = 6;
  Match chosen;
  chosen.cost = std::numeric_limits<double>::infinity();
  for (const double along : {-0.25, 0.0, 0.25}) {
    for (const double yaw : {-0.1, 0.0, 0.1}) {
      chosen = better(chosen, match(fine, few, expected * Pose2{along, 0, yaw}, expected, prior, quick));
    }
  }
  return better(best, match(fine, points_base, chosen.T_map_base, expected, prior, options));
}

}  // namespace parhelion::pose
