#include "fusion/pose/localizer_search.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::pose {
namespace {

constexpr std::size_t kMaxHypotheses = 40;
constexpr std::size_t kMinPoints = 20;
constexpr double kMinExplained = 0.55;
constexpr int kMinScans = 4;
/// A candidate is accepted with this mean advantage per scan over the runner-up, or after the robot has moved
/// so far that a wrong candidate would have been noticed.
constexpr double kClearLead = 0.08;
constexpr double kRevealingDistance = 1.0, kRevealingTurn = 1.0;  ///< m, rad
constexpr double kSlightLead = 0.03;
constexpr int kMaxScans = 150;  ///< then the search restarts

MatchOptions options(const FrozenMap& map) {
  MatchOptions result;
  result.range_sigma = map.sigma;
  return result;
}

}  // namespace

void GlobalSearch::seed(const FrozenMap& map, const ScanPoints& scan) {
  scans_ = 0;
  driven_ = turn_ = 0;
  const auto few = thinned(scan.points, 120);
  const auto candidates =
      map.likelihood.search(few, map.likelihood.everywhere(), {0.45, kMaxHypotheses, 0.8, 0.4});
  for (const auto& candidate : candidates) hypotheses_.push_back({candidate.T_map_base, 0});
}

void GlobalSearch::follow(const FrozenMap& map, const ScanPoints& scan, const Pose2& step) {
  for (Hypothesis& hypothesis : hypotheses_) {
    const Pose2 expected = hypothesis.T_map_base * step;
    const Match found =
        match(map.fine, scan.points, expected, expected, Eigen::Matrix3d::Zero(), options(map));
    const Pose2 moved = expected.inverse() * found.T_map_base;
    const bool jumped = moved.position().norm() > 0.5 || std::abs(moved.yaw) > 0.3;
    hypothesis.T_map_base = jumped ? expected : found.T_map_base;
    hypothesis.evidence += jumped ? 0 : found.explained - 2 * found.rms;
  }
}

void GlobalSearch::merge() {
  std::stable_sort(hypotheses_.begin(), hypotheses_.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.evidence > b.evidence; });
  std::vector<Hypothesis> kept;
  const double best = hypotheses_.empty() ? 0 : hypotheses_.front().evidence;
  for (const Hypothesis& hypothesis : hypotheses_) {
    const bool doubled = std::any_of(kept.begin(), kept.end(), [&](const Hypothesis& other) {
      return (other.T_map_base.position() - hypothesis.T_map_base.position()).norm() < 0.3 &&
             std::abs(wrap_angle(other.T_map_base.yaw - hypothesis.T_map_base.yaw)) < 0.2;
    });
    // Candidates far behind the best after several scans are dropped.
    const bool behind = scans_ >= kMinScans && best - hypothesis.evidence > 0.4 * scans_;
    if (!doubled && !behind) kept.push_back(hypothesis);
  }
  hypotheses_ = std::move(kept);
}

std::optional<Pose2> GlobalSearch::add(const FrozenMap& map, const ScanPoints& scan, const Pose2& step) {
  if (scan.points.size() < kMinPoints) {
    for (Hypothesis& hypothesis : hypotheses_) hypothesis.T_map_base = hypothesis.T_map_base * step;
    return std::nullopt;
  }
  const bool seeded = hypotheses_.empty();
  if (seeded) seed(map, scan);
  follow(map, scan, seeded ? Pose2{} : step);
  ++scans_;
  if (!seeded) driven_ += step.position().norm(), turn_ += std::abs(step.yaw);
  merge();
  if (hypotheses_.empty()) return std::nullopt;
  const double best = hypotheses_.front().evidence / scans_;
  const double second = hypotheses_.size() > 1 ? hypotheses_[1].evidence / scans_ : 0;
  const bool revealed = driven_ > kRevealingDistance || turn_ > kRevealingTurn;
  if (scans_ >= kMinScans && best < kMinExplained) {
    restart();
    return std::nullopt;
  }
  if (scans_ >= kMinScans && best - second > (revealed ? kSlightLead : kClearLead))
    return hypotheses_.front().T_map_base;
  if (scans_ > kMaxScans) restart();
  return std::nullopt;
}

}  // namespace parhelion::pose
