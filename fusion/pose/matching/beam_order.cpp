#include "fusion/pose/matching/beam_order.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/pose/matching/scan_match.hpp"
#include "fusion/pose/matching/scan_points.hpp"
#include "fusion/pose/matching/surfel_map.hpp"

namespace parhelion::pose {
namespace {

constexpr Duration kShortSweep = milliseconds(40);
constexpr Duration kLongestStep = milliseconds(600);  ///< from scan to scan
constexpr double kOverlap = 1.5;                      ///< of that: a longer sweep is described wrongly
constexpr std::size_t kPointsToFollow = 120;
constexpr double kFar = 50;       ///< m from the base
constexpr double kStands = 5e-4;  ///< m and rad, of odometry from scan to scan
/// rad, during a sweep: at rest, and enough to tell the orders apart.
constexpr double kAtRest = 0.004, kTurning = 0.03;
/// Of a turn: by so much its rate may change from one scan to the next.
constexpr double kSteady = 0.5;
constexpr double kFarTurned = 0.5;                 ///< rad, of two scans: then equal rates tell, too
constexpr double kMaxMoved = 1, kMaxTurned = 1.2;  ///< m, rad: beyond, two scans see too little in common
constexpr double kCell = 0.2;                      ///< m, of the map of one scan
constexpr double kRangeSigma = 0.02;               ///< m
constexpr double kMinExplained = 0.5;
/// Of the difference of two costs (MatchOptions): what one comparison counts at most, and what all have to
/// show. Chosen on the TurtleBot 4 of docs/measurements/calibration.md and on Neatos.
constexpr double kMaxPreference = 20, kEnough = 100;
constexpr int kFewest = 8, kMax = 60, kMaxFollowed = 2000;
constexpr double kAgreeing = 0.8;

LaserDescription with_beams(LaserDescription laser, double interval) {
  laser.beam_interval = interval;
  return laser;
}

/// Without far ones: a map of a damaged scan would have no end.
std::vector<Eigen::Vector2d> near_points(const Scan& scan, const LaserDescription& laser,
                                         const SweepMotion& sweep) {
  std::vector<Eigen::Vector2d> points = deskewed(scan, laser, sweep).points;
  std::erase_if(points, [](const Eigen::Vector2d& p) { return !(p.norm() < kFar); });
  return points;
}

/// Points on the points of another scan.
Match matched(const std::vector<Eigen::Vector2d>& first, const std::vector<Eigen::Vector2d>& second,
              const Pose2& expected) {
  SurfelMap fine(kCell), coarse(4 * kCell);
  fine.add(first, {});
  coarse.add(first, {});
  const Eigen::Matrix3d prior = Eigen::Vector3d(100, 100, 30).asDiagonal();  // sigmas 0.1 m, 0.2 rad
  return match_from_several(fine, coarse, second, expected, prior, {.range_sigma = kRangeSigma});
}

}  // namespace

BeamOrder::BeamOrder(const LaserDescription& laser)
    : described_(laser), reversed_(with_beams(laser, -laser.beam_interval)), at_once_(with_beams(laser, 0)) {
  at_once_.pass_period = 0;
}

BeamOrder::Verdict BeamOrder::add(const Scan& scan, const std::optional<Pose2>& step) {
  if (verdict_ != Verdict::unknown || comparisons_ >= kMax || followed_ >= kMaxFollowed) return verdict_;
  if (scan.is_timed() || scan.ranges.empty()) return verdict_;
  const SweepSpan span = sweep_span(described_, scan.ranges.size());
  if (span.end - span.begin < kShortSweep) return verdict_;
  sweep_seconds_ = (span.end - span.begin).seconds();
  const Pose2 T_local_newest = T_local_newest_;
  const auto twist = newest_ ? follow(scan, step) : std::nullopt;
  if (!twist) first_.reset();
  // During the sweep of the scan before this one.
  if (twist && before_newest_) {
    const Twist2 mean{(twist->vx + before_newest_->vx) / 2, (twist->vy + before_newest_->vy) / 2,
                      (twist->wz + before_newest_->wz) / 2};
    const double change = std::abs(twist->wz - before_newest_->wz) * sweep_seconds_;
    if (change < std::max(kAtRest, kSteady * std::abs(mean.wz) * sweep_seconds_))
      compare({*newest_, SweepMotion(mean), T_local_newest});
  }
  before_newest_ = twist;
  newest_ = scan;
  if (verdict_ != Verdict::unknown) newest_.reset(), first_.reset();
  return verdict_;
}

/// The motion since the newest scan, from both as if each were of one instant; nullopt: they do not fit.
std::optional<Twist2> BeamOrder::follow(const Scan& scan, const std::optional<Pose2>& step) {
  const Duration passed = scan.stamp - newest_->stamp;
  if (passed <= Duration{} || passed > kLongestStep || sweep_seconds_ > kOverlap * passed.seconds())
    return std::nullopt;
  const bool stood = before_newest_ && std::abs(turn_during(*before_newest_)) < kAtRest;
  if (stood && step && step->position().norm() < kStands && std::abs(step->yaw) < kStands) return Twist2{};
  ++followed_;
  const bool is_near = step && step->finite() && step->position().norm() < kMaxMoved;
  const Pose2 start = is_near ? *step : Pose2{};
  const Match match = matched(near_points(*newest_, at_once_, {}),
                              thinned(near_points(scan, at_once_, {}), kPointsToFollow), start);
  if (match.explained < kMinExplained) return std::nullopt;
  T_local_newest_ = T_local_newest_ * match.T_map_base;
  return twist_between({}, match.T_map_base, passed.seconds());
}

void BeamOrder::compare(const View& view) {
  const double turn = turn_during(view.sweep);
  const Pose2 moved = first_ ? first_->T_local_base.inverse() * view.T_local_base : Pose2{};
  if (!first_ || std::abs(turn) < kAtRest || moved.position().norm() > kMaxMoved ||
      std::abs(moved.yaw) > kMaxTurned) {
    first_ = view;
    return;
  }
  if (std::abs(turn - turn_during(first_->sweep)) < kTurning && std::abs(moved.yaw) < kFarTurned) return;
  if (const auto better = preference(view)) {
    ++comparisons_;
    for_reversed_ += *better > 0;
    sum_ += std::clamp(*better, -kMaxPreference, kMaxPreference);
    conclude();
  }
}

/// By how much the reversed order fits better; nullopt: the scans do not fit.
std::optional<double> BeamOrder::preference(const View& view) const {
  const Pose2 expected = first_->T_local_base.inverse() * view.T_local_base;
  const auto with = [&](const LaserDescription& laser) {
    return matched(near_points(first_->scan, laser, first_->sweep), near_points(view.scan, laser, view.sweep),
                   expected);
  };
  const Match described = with(described_), reversed = with(reversed_);
  if (std::max(described.explained, reversed.explained) < kMinExplained) return std::nullopt;
  return described.cost - reversed.cost;
}

BeamOrder beam_order_of(std::span<const Scan> scans, const LaserDescription& laser) {
  BeamOrder order(laser);
  for (const Scan& scan : scans) order.add(scan, std::nullopt);
  return order;
}

void BeamOrder::conclude() {
  const double fraction = static_cast<double>(for_reversed_) / comparisons_;
  if (comparisons_ < kFewest || std::abs(sum_) <= kEnough) return;
  if (sum_ > 0 && fraction >= kAgreeing) verdict_ = Verdict::reversed;
  if (sum_ < 0 && fraction <= 1 - kAgreeing) verdict_ = Verdict::as_described;
}

}  // namespace parhelion::pose
