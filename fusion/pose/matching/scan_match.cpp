#include "fusion/pose/matching/scan_match.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "fusion/pose/matching/scan_directions.hpp"
#include "fusion/pose/matching/scan_points.hpp"

namespace parhelion::pose {
namespace {

constexpr double kKnee = 9;  ///< chi^2 at which a point has weight 1/4; maximum cost of a point

/// Neighbouring beams share errors of the map and of the laser: they are not independent.
constexpr double kIndependentFraction = 0.1;
constexpr double kCrosses = 0.7;     ///< cosine between a line of points and the normal of a surface
constexpr double kScattered = 0.25;  ///< weight of a point whose surfel is no surface

/// Of a growing map. Where the information along one axis is at most this part of that across it, normals
/// that differ from across by no more than this sine, and by so many sigmas of their own error, count as
/// across. Chosen on generated houses with a depth camera and yards with hedges.
constexpr double kOneDirection = 0.1, kAlike = 0.105, kAlikeSigmas = 3;
/// Of the points of a surfel, those whose errors are independent.
constexpr double kIndependentPoints = 0.1;
/// Of through_variance(): what is as long runs on.
constexpr double kRunsOn = 0.6;

struct NormalEquations {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double squares = 0;
  double cost = 0;  ///< of all points; those without a surfel have the maximum cost
  int explained = 0;
};

/// As assign_directions() gives them, in the frame of the points; empty where they are not asked for.
using Directions = std::span<const ScanDirection>;

/// Symmetric 2 x 2 matrix.
struct Weight {
  double xx, xy, yy;

  /// Of distances along a unit vector alone.
  static Weight along(const Eigen::Vector2d& unit, double weight) {
    return {weight * unit.x() * unit.x(), weight * unit.x() * unit.y(), weight * unit.y() * unit.y()};
  }
  static Weight inverse_of(double xx, double xy, double yy, double weight) {
    const double scale = weight / (xx * yy - xy * xy);
    return {scale * yy, -scale * xy, scale * xx};
  }
  Eigen::Vector2d operator*(const Eigen::Vector2d& v) const {
    return {xx * v.x() + xy * v.y(), xy * v.x() + yy * v.y()};
  }
  /// The same for motions across `unit` alone.
  Weight without(const Eigen::Vector2d& unit) const {
    const Eigen::Vector2d of = *this * unit;
    const double along = unit.dot(of);
    return {xx - 2 * unit.x() * of.x() + along * unit.x() * unit.x(),
            xy - unit.x() * of.y() - unit.y() * of.x() + along * unit.x() * unit.y(),
            yy - 2 * unit.y() * of.y() + along * unit.y() * unit.y()};
  }
};

bool is_surface(const Surfel& surfel, bool growing) { return surfel.flat || (growing && surfel.thick); }

/// What a point at an offset from its surfel counts, and its distance from that surface (m).
struct Weighed {
  Weight weight;
  double distance;
};

/// `direction`: in the map frame. nullopt: the point says nothing of this surface. `noise`: m^2.
std::optional<Weighed> weighed(const Surfel& surfel, const Eigen::Vector2d& offset,
                               const ScanDirection& direction, double noise, bool growing) {
  const Eigen::Vector2d& along = direction.along;
  const bool on_line = !along.isZero(0);
  if (is_surface(surfel, growing)) {
    if (on_line && std::abs(along.dot(surfel.normal)) > kCrosses) return {};
    if (direction.grazing) {
      const Eigen::Vector2d normal(-along.y(), along.x());
      return Weighed{Weight::along(normal, 1 / (noise + normal.dot(surfel.covariance * normal))),
                     std::abs(normal.dot(offset))};
    }
    return Weighed{Weight::along(surfel.normal, 1 / (noise + surfel.thickness * surfel.thickness)),
                   std::abs(surfel.normal.dot(offset))};
  }
  const Eigen::Matrix2d& covariance = surfel.covariance;
  if (on_line) {
    const Eigen::Vector2d normal(-along.y(), along.x());
    return Weighed{Weight::along(normal, kScattered / (noise + normal.dot(covariance * normal))),
                   offset.norm()};
  }
  return Weighed{
      Weight::inverse_of(covariance(0, 0) + noise, covariance(0, 1), covariance(1, 1) + noise, kScattered),
      offset.norm()};
}

/// The map has been seen around a point: the mean of what is near lies in the point's own cell.
bool is_seen_around(const Surfel& surfel, const Eigen::Vector2d& point, double cell) {
  return cell_of(point.x(), cell) == cell_of(surfel.mean.x(), cell) &&
         cell_of(point.y(), cell) == cell_of(surfel.mean.y(), cell);
}

/// A point on this surface shows nothing along the unit vector, but for errors of a growing map. `weight`: of
/// the point.
bool is_blind_along(const Eigen::Vector2d& unit, const Surfel& surfel, const Weight& weight, double cell) {
  if (!is_surface(surfel, true)) return unit.dot(surfel.covariance * unit) > kRunsOn * through_variance(cell);
  const double slope = surfel.thickness * surfel.thickness /
                       (kIndependentPoints * static_cast<double>(surfel.points) * surfel.covariance.trace());
  const double alike = kAlike * kAlike + kAlikeSigmas * kAlikeSigmas * slope;
  return unit.dot(weight * unit) < alike * (weight.xx + weight.yy);
}

/// H and b are summed by their entries, as the products of symmetric matrices repeat most of them. `blind`:
/// unit vector along which points that are blind there do not move the pose; zero: none.
NormalEquations equations(const SurfelMap& map, std::span<const Eigen::Vector2d> points,
                          Directions directions, const Pose2& pose, const MatchOptions& options,
                          const Eigen::Vector2d& blind = Eigen::Vector2d::Zero()) {
  const bool any_blind = !blind.isZero(0);
  NormalEquations sum;
  double xx = 0, xy = 0, yy = 0, xt = 0, yt = 0, tt = 0, x = 0, y = 0, t = 0;
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
    ScanDirection direction;
    if (!directions.empty()) {
      const Eigen::Vector2d& own = directions[i].along;
      direction = {{c * own.x() - s * own.y(), s * own.x() + c * own.y()}, directions[i].grazing};
    }
    const auto found = weighed(*surfel, offset, direction, noise, options.growing);
    if (!found || found->distance > options.gate) continue;
    if (found->distance < options.inlier) {
      ++sum.explained;
      sum.squares += found->distance * found->distance;
    }
    if (options.growing && !is_seen_around(*surfel, q, map.cell())) continue;
    // Geman-McClure on the normalised distance: people and moved chairs are down-weighted.
    Weight W = found->weight;
    Eigen::Vector2d weighed_offset = W * offset;
    const double chi2 = offset.dot(weighed_offset);
    const double robust = kKnee / (kKnee + chi2);
    const double k = robust * robust;
    sum.cost += chi2 * robust - kKnee;
    const Eigen::Vector2d turning(-arm.y(), arm.x());  // of the point by the yaw
    Eigen::Vector2d weighed_turning = W * turning;
    tt += k * turning.dot(weighed_turning), t += k * turning.dot(weighed_offset);
    if (any_blind && is_blind_along(blind, *surfel, W, map.cell())) {
      W = W.without(blind);
      weighed_offset -= blind * blind.dot(weighed_offset);
      weighed_turning -= blind * blind.dot(weighed_turning);
    }
    xx += k * W.xx, xy += k * W.xy, yy += k * W.yy;
    xt += k * weighed_turning.x(), yt += k * weighed_turning.y();
    x += k * weighed_offset.x(), y += k * weighed_offset.y();
  }
  sum.cost *= kIndependentFraction;
  sum.H << xx, xy, xt, xy, yy, yt, xt, yt, tt;
  sum.H *= kIndependentFraction;
  sum.b = kIndependentFraction * Eigen::Vector3d(x, y, t);
  return sum;
}

/// Unit vector along the walls where walls of one direction are all that the points show; otherwise zero.
Eigen::Vector2d single_direction(const Eigen::Matrix3d& H) {
  const double mean = (H(0, 0) + H(1, 1)) / 2, half = (H(0, 0) - H(1, 1)) / 2;
  const double radius = std::hypot(half, H(0, 1));
  if (radius <= 0 || mean - radius > kOneDirection * (mean + radius)) return Eigen::Vector2d::Zero();
  const double angle = 0.5 * std::atan2(2 * H(0, 1), H(0, 0) - H(1, 1));
  return {-std::sin(angle), std::cos(angle)};
}

struct DirectedPoints {
  std::span<const Eigen::Vector2d> points;
  Directions directions;
};

/// `directions`: where they are kept.
DirectedPoints with_directions(std::span<const Eigen::Vector2d> points, const MatchOptions& options,
                               std::vector<ScanDirection>& directions) {
  directions.clear();
  if (options.by_direction) assign_directions(points, directions);
  return {points, directions};
}

/// As in match().
struct Prior {
  Pose2 expected;
  Eigen::Matrix3d information;

  Eigen::Vector3d off(const Pose2& pose) const {
    return {pose.x - expected.x, pose.y - expected.y, wrap_angle(pose.yaw - expected.yaw)};
  }
};

Match match(const SurfelMap& map, const DirectedPoints& scan, const Pose2& start, const Prior& prior,
            const MatchOptions& options) {
  Pose2 pose = start;
  const Eigen::Matrix3d regular = 1e-3 * Eigen::Matrix3d::Identity();
  Eigen::Vector2d blind = Eigen::Vector2d::Zero();
  if (options.growing)
    blind = single_direction(equations(map, scan.points, scan.directions, pose, options).H);
  for (int i = 0; i < options.iterations; ++i) {
    const NormalEquations sum = equations(map, scan.points, scan.directions, pose, options, blind);
    const Eigen::Vector3d step =
        (sum.H + prior.information + regular).ldlt().solve(-(sum.b + prior.information * prior.off(pose)));
    if (!step.allFinite()) break;
    pose = {pose.x + step.x(), pose.y + step.y(), wrap_angle(pose.yaw + step.z())};
    if (step.head<2>().norm() < 1e-4 && std::abs(step.z()) < 2e-5) break;
  }
  const NormalEquations sum = equations(map, scan.points, scan.directions, pose, options);
  Match result;
  result.T_map_base = pose;
  result.information = sum.H;
  const Eigen::Vector3d off = prior.off(pose);
  result.cost = sum.cost + off.dot(prior.information * off);
  result.points = sum.explained;
  result.explained =
      scan.points.empty() ? 0 : static_cast<double>(sum.explained) / static_cast<double>(scan.points.size());
  result.rms = sum.explained > 0 ? std::sqrt(sum.squares / sum.explained) : 0;
  return result;
}

Match better(const Match& a, const Match& b) { return b.cost < a.cost ? b : a; }

/// From both a match ends at the same place. Chosen on SENA, Jarvis and UAL.
bool is_same(const Pose2& a, const Pose2& b) {
  constexpr double position = 0.02, yaw = 0.01;  // m, rad
  return (a.position() - b.position()).norm() < position && std::abs(wrap_angle(a.yaw - b.yaw)) < yaw;
}

/// The best of matches from positions along the path and headings around it. All begin; the few that look
/// best go on.
Match best_start(const SurfelMap& map, const DirectedPoints& scan, const Prior& prior,
                 const MatchOptions& options) {
  constexpr std::size_t kept = 3;
  MatchOptions first = options, second = options;
  first.iterations = 2;
  second.iterations = 4;
  std::array<Match, 9> begun;
  std::size_t count = 0;
  for (const double along : {-0.25, 0.0, 0.25}) {
    for (const double yaw : {-0.1, 0.0, 0.1})
      begun[count++] = match(map, scan, prior.expected * Pose2{along, 0, yaw}, prior, first);
  }
  std::stable_sort(begun.begin(), begun.end(),
                   [](const Match& a, const Match& b) { return a.cost < b.cost; });
  Match best = match(map, scan, begun[0].T_map_base, prior, second);
  for (std::size_t i = 1; i < kept; ++i)
    best = better(best, match(map, scan, begun[i].T_map_base, prior, second));
  return best;
}

}  // namespace

Match match(const SurfelMap& map, std::span<const Eigen::Vector2d> points_base, const Pose2& start,
            const Pose2& expected, const Eigen::Matrix3d& prior, const MatchOptions& options) {
  thread_local std::vector<ScanDirection> scratch;
  return match(map, with_directions(points_base, options, scratch), start, {expected, prior}, options);
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
  thread_local std::vector<ScanDirection> scratch_of_all, scratch_of_few;
  const Prior around{expected, prior};
  const DirectedPoints all = with_directions(points_base, options, scratch_of_all);
  const DirectedPoints some = with_directions(few, options, scratch_of_few);
  MatchOptions rough = options;
  rough.iterations = 6;
  rough.gate = coarse.cell();
  rough.range_sigma = fine.cell();
  const Match near = match(coarse, some, expected, around, rough);
  Match best = match(fine, all, expected, around, options);
  if (!is_same(best.T_map_base, near.T_map_base))
    best = better(best, match(fine, all, near.T_map_base, around, options));
  const Pose2 off = expected.inverse() * best.T_map_base;
  constexpr double sure = 0.85;
  if (best.explained > sure && off.position().norm() < fine.cell() && std::abs(off.yaw) < 0.03) return best;
  const Match chosen = best_start(fine, some, around, options);
  if (is_same(best.T_map_base, chosen.T_map_base)) return best;
  return better(best, match(fine, all, chosen.T_map_base, around, options));
}

}  // namespace parhelion::pose
