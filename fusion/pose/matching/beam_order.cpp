#include "fusion/pose/matching/beam_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

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
constexpr double kMoves = 5e-3;   ///< m and rad, of a match of two scans
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
constexpr int kFewest = 8, kMax = 60, kMaxMoving = 2000, kMaxFollowed = 20'000;
constexpr double kAgreeing = 0.8;

LaserDescription with_beams(LaserDescription laser, double interval) {
  laser.beam_interval = interval;
  return laser;
}

/// s between two beams as described, or of a laser that turns once a scan; 0: the scan shows no such laser.
double sweeping_interval(const LaserDescription& laser, const Scan& scan) {
  if (laser.beam_interval != 0) return std::abs(laser.beam_interval);
  const double turn = std::abs(double{scan.angle_increment}) / (2 * std::numbers::pi);
  const bool possible = turn * static_cast<double>(scan.ranges.size() - 1) <= 1.01;  // of a whole turn
  return possible ? turn * laser.scan_period : 0;
}

LaserDescription without_times(LaserDescription laser) {
  laser.beam_interval = laser.pass_period = 0;
  laser.passes = 1;
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

void BeamOrder::Rivals::add(double first_cost, double second_cost) {
  second_better += first_cost > second_cost ? 1 : 0;
  sum += std::clamp(first_cost - second_cost, -kMaxPreference, kMaxPreference);
}

bool BeamOrder::Rivals::second_wins(int comparisons) const {
  return sum > kEnough && second_better >= kAgreeing * comparisons;
}

bool BeamOrder::Rivals::first_wins(int comparisons) const {
  return sum < -kEnough && second_better <= (1 - kAgreeing) * comparisons;
}

BeamOrder::BeamOrder(const LaserDescription& laser) : described_(laser), shown_(laser) {}

/// False: the scan shows no sweep.
bool BeamOrder::describe_orders(const Scan& scan) {
  if (forward_) return true;
  const double interval = sweeping_interval(described_, scan);
  if (interval == 0) return false;
  at_once_ = without_times(described_);
  forward_ = with_beams(described_.beam_interval != 0 ? described_ : *at_once_, interval);
  backward_ = with_beams(*forward_, -interval);
  return true;
}

bool BeamOrder::done() const {
  return verdict_ != Verdict::unknown || comparisons_ >= kMax || moved_ >= kMaxMoving ||
         followed_ >= kMaxFollowed;
}

BeamOrder::Verdict BeamOrder::add(const Scan& scan, const std::optional<Pose2>& step) {
  if (done() || scan.is_timed() || scan.ranges.empty() || !describe_orders(scan)) return verdict_;
  const SweepSpan span = sweep_span(*forward_, scan.ranges.size());
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
  const Match match = matched(near_points(*newest_, *at_once_, {}),
                              thinned(near_points(scan, *at_once_, {}), kPointsToFollow), start);
  if (match.explained < kMinExplained) return std::nullopt;
  T_local_newest_ = T_local_newest_ * match.T_map_base;
  moved_ += match.T_map_base.position().norm() > kMoves || std::abs(match.T_map_base.yaw) > kMoves;
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
  const Pose2 expected = first_->T_local_base.inverse() * view.T_local_base;
  const auto with = [&](const LaserDescription& laser) {
    return matched(near_points(first_->scan, laser, first_->sweep), near_points(view.scan, laser, view.sweep),
                   expected);
  };
  const Match forward = with(*forward_), backward = with(*backward_), at_once = with(*at_once_);
  if (std::max({forward.explained, backward.explained, at_once.explained}) < kMinExplained) return;
  ++comparisons_;
  forward_backward_.add(forward.cost, backward.cost);
  forward_at_once_.add(forward.cost, at_once.cost);
  backward_at_once_.add(backward.cost, at_once.cost);
  conclude();
}

BeamOrder beam_order_of(std::span<const Scan> scans, const LaserDescription& laser) {
  BeamOrder order(laser);
  for (const Scan& scan : scans) order.add(scan, std::nullopt);
  return order;
}

/// The two directions of a sweep differ the most and are told apart first. Against a sweep as described no
/// more is asked of beams at once than that they fit no better; one that is not described has to be shown.
void BeamOrder::conclude() {
  if (comparisons_ < kFewest) return;
  if (forward_at_once_.second_wins(comparisons_) && backward_at_once_.second_wins(comparisons_)) {
    verdict_ = described_.beam_interval == 0 ? Verdict::as_described : Verdict::at_once;
    if (differs()) shown_ = *at_once_;
    return;
  }
  const bool is_forward = forward_backward_.first_wins(comparisons_);
  if (!is_forward && !forward_backward_.second_wins(comparisons_)) return;
  const Rivals& at_once = is_forward ? forward_at_once_ : backward_at_once_;
  const LaserDescription& shown = is_forward ? *forward_ : *backward_;
  if (described_.beam_interval == 0) {
    if (!at_once.first_wins(comparisons_)) return;
    verdict_ = Verdict::swept;
  } else {
    if (at_once.sum > 0) return;
    verdict_ = shown.beam_interval == described_.beam_interval ? Verdict::as_described : Verdict::reversed;
  }
  if (differs()) shown_ = shown;
}

void BeamOrder::correct(LaserDescription& laser) const {
  laser.beam_interval = shown_.beam_interval;
  laser.passes = shown_.passes;
  laser.pass_period = shown_.pass_period;
}

std::string BeamOrder::what() const {
  std::string how = "all at once, not one after the other as described";
  if (verdict_ == Verdict::reversed) how = "in the reverse of the described order";
  if (verdict_ == Verdict::swept)
    how = std::string("one after the other, the ") + (shown_.beam_interval < 0 ? "last" : "first") +
          " one first, not all at once as described";
  return "the laser measures the beams of a message " + how + ", as " + std::to_string(comparisons_) +
         " scans of turns show";
}

std::string BeamOrder::advice() const {
  char text[96];
  std::snprintf(text, sizeof text, ": write beam_interval: %.6g s in the robot description",
                shown_.beam_interval);
  return what() + text;
}

}  // namespace parhelion::pose
