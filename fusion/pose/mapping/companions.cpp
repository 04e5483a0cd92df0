#include "fusion/pose/mapping/companions.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion::pose {
namespace {

// Chosen on generated drives along corridors (docs/measurements/slam.md).
constexpr double kDriven = 0.4;               ///< m, after which what stands is elsewhere for the robot
constexpr Duration kRemembered = seconds(3);  ///< after more, a companion may have changed its place
constexpr double kWidth = 0.6;                ///< m, of a companion at most
constexpr double kStride = 0.4;               ///< m, between legs
constexpr double kReach = 6;                  ///< m from the laser
constexpr double kBeside = 0.5;               ///< m, by which its place beside the robot may change
constexpr double kInFront = 0.3;              ///< m
/// m, and as a fraction of the range: between neighbouring points of one thing.
constexpr double kGap = 0.12, kGapFraction = 0.03;
constexpr double kDrivenOver = 0.25;  ///< m from the path of the base, where nothing can have stayed
constexpr double kMaxFraction = 0.5;  ///< of a scan's points
constexpr std::size_t kDirections = 360;
/// Directions without a return, with returns within so many at both sides, are free: the laser sees farther
/// than it reaches.
constexpr std::size_t kBetween = 45;

std::size_t direction_of(const Eigen::Vector2d& ray) {
  const double turns = std::atan2(ray.y(), ray.x()) / (2 * std::numbers::pi) + 0.5;
  return std::min(kDirections - 1, static_cast<std::size_t>(turns * static_cast<double>(kDirections)));
}

}  // namespace

std::vector<Companions::Thing> Companions::things_of(const ScanPoints& scan) {
  const std::vector<Eigen::Vector2d>& points = scan.points;
  const auto range = [&](std::size_t i) { return (points[i] - scan.laser).norm(); };
  const auto end_of = [&](std::size_t begin) {
    std::size_t end = begin + 1;
    while (end < points.size() && (points[end] - points[end - 1]).norm() < kGap + kGapFraction * range(end))
      ++end;
    return end;
  };
  std::vector<Thing> things;
  for (std::size_t begin = 0, end = 0; begin < points.size(); begin = end) {
    end = end_of(begin);
    // The other leg may be a step farther.
    while (end < points.size() && (points[end] - points[end - 1]).norm() < kStride &&
           (points[end_of(end) - 1] - points[begin]).norm() < kWidth)
      end = end_of(end);
    const bool in_front = (begin == 0 || range(begin - 1) > range(begin) + kInFront) &&
                          (end == points.size() || range(end) > range(end - 1) + kInFront);
    const double width = (points[end - 1] - points[begin]).norm();
    if (!in_front || width > kWidth || range(begin) > kReach) continue;
    Thing thing{begin, end};
    for (std::size_t i = begin; i < end; ++i) thing.middle += points[i];
    thing.middle /= static_cast<double>(end - begin);
    things.push_back(thing);
  }
  return things;
}

Companions::PastScan Companions::described(const ScanPoints& scan) const {
  PastScan result{scan.stamp, T_local_base_, scan.laser, std::vector<double>(kDirections), things_of(scan)};
  for (const Eigen::Vector2d& p : scan.points) {
    const Eigen::Vector2d ray = p - scan.laser;
    double& nearest = result.nearest[direction_of(ray)];
    if (nearest == 0 || ray.norm() < nearest) nearest = ray.norm();
  }
  return result;
}

const Companions::PastScan* Companions::some_path_before(SensorTime stamp) const {
  for (auto past = past_.rbegin(); past != past_.rend(); ++past) {
    if (stamp - past->stamp > kRemembered) return nullptr;
    if ((T_local_base_.position() - past->T_local_base.position()).norm() >= kDriven) return &*past;
  }
  return nullptr;
}

/// p: base_link at that scan.
bool Companions::is_free(const PastScan& seen, const Eigen::Vector2d& p) {
  const Eigen::Vector2d ray = p - seen.laser;
  const std::size_t direction = direction_of(ray);
  bool returned = false;
  for (const std::size_t i : {direction + kDirections - 1, direction, direction + 1}) {
    const double nearest = seen.nearest[i % kDirections];
    if (nearest > 0 && nearest < ray.norm() + kInFront) return false;
    returned |= nearest > 0;
  }
  const auto returns_beside = [&](std::size_t turn) {
    for (std::size_t k = 2; k <= kBetween; ++k)
      if (seen.nearest[(direction + k * turn) % kDirections] > 0) return true;
    return false;
  };
  return returned || (returns_beside(1) && returns_beside(kDirections - 1));
}

/// p: base_link then. It is seen through now, or the robot has driven over it.
bool Companions::is_gone(const PastScan& now, const Eigen::Vector2d& p, const Pose2& T_then_now) {
  const Eigen::Vector2d driven = T_then_now.position();
  const double along = std::clamp(p.dot(driven) / driven.squaredNorm(), 0.0, 1.0);
  return (p - along * driven).norm() < kDrivenOver || is_free(now, T_then_now.inverse() * p);
}

/// In the order of the beams.
std::vector<Companions::Thing> Companions::companions_in(const PastScan& now) const {
  std::vector<Thing> companions;
  const PastScan* then = some_path_before(now.stamp);
  if (then == nullptr) return companions;
  const Pose2 T_then_now = then->T_local_base.inverse() * now.T_local_base;
  for (const Thing& thing : now.things) {
    const bool came_along = std::any_of(then->things.begin(), then->things.end(), [&](const Thing& before) {
      return (before.middle - thing.middle).norm() < kBeside &&
             (is_free(*then, T_then_now * thing.middle) || is_gone(now, before.middle, T_then_now));
    });
    if (came_along) companions.push_back(thing);
  }
  return companions;
}

ScanPoints Companions::without(const ScanPoints& scan, const Pose2& odometry) {
  if (!odometry.finite() || (!past_.empty() && scan.stamp <= past_.back().stamp)) forget();
  if (!odometry.finite()) return scan;
  T_local_base_ = T_local_base_ * odometry;
  PastScan now = described(scan);
  const std::vector<Thing> companions = companions_in(now);
  while (!past_.empty() && scan.stamp - past_.front().stamp > kRemembered) past_.pop_front();
  past_.push_back(std::move(now));

  ScanPoints result = scan;
  // From the last on, so that the indices of the others stay.
  for (auto companion = companions.rbegin(); companion != companions.rend(); ++companion) {
    const auto first = result.points.begin();
    result.points.erase(first + static_cast<std::ptrdiff_t>(companion->begin),
                        first + static_cast<std::ptrdiff_t>(companion->end));
  }
  const double left = static_cast<double>(result.points.size());
  return left < (1 - kMaxFraction) * static_cast<double>(scan.points.size()) ? scan : result;
}

void Companions::forget() {
  past_.clear();
  T_local_base_ = {};
}

}  // namespace parhelion::pose
