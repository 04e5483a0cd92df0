#include "fusion/pose/search/localizer_search.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/pose/matching/scan_match.hpp"

namespace parhelion::pose {
namespace {

constexpr std::size_t kMaxHypotheses = 48;
constexpr std::size_t kMinPoints = 20;
constexpr std::size_t kSearchPoints = 70, kFollowPoints = 160;
constexpr std::size_t kRefinedPerScan = 16;  ///< candidates of the search
/// Places with lower scores than the best one are looked for down to this difference: in the first search for
/// the best ones, in later ones for all that may be right.
constexpr double kFirstSpread = 0.08, kSpread = 0.2;
constexpr int kMinScans = 4, kMinSearches = 2;
constexpr double kHopeless = 0.4;  ///< explained fraction, below which a place is dropped
/// Fraction of the beams that the accepted place must explain: this, or this much of what the map usually
/// does, if that is less, but not below the third.
constexpr double kMinExplained = 0.7, kMinOfUsual = 0.85, kMinEver = 0.5;

/// A place is ruled out if the leader explains more beams, by this fraction of all, and this many times as
/// many as it explains less. What the last search has not listed has to score less by kClearScore. Chosen on
/// 100 starts in repeating_building.hpp (seeds 50 to 53, a third of it changed) and on its symmetric ones,
/// for no wrong place.
constexpr double kClearLead = 0.08, kClearRatio = 3, kClearScore = 0.1;

/// A robot that was carried away is hardly ever put down where odometry predicts it, to a few decimetres. So
/// a place there need not rule out all others: it must lead for so many scans and so far (m).
constexpr int kScansWhereExpected = 10;
constexpr double kDrivenWhereExpected = 1;

/// The same place, m and rad.
constexpr double kSame = 0.3, kSameYaw = 0.2;

bool is_same(const Pose2& a, const Pose2& b) {
  return (a.position() - b.position()).norm() < kSame && std::abs(wrap_angle(a.yaw - b.yaw)) < kSameYaw;
}

MatchOptions quick(const FrozenMap& map) {
  MatchOptions result;
  result.range_sigma = map.sigma;
  result.iterations = 6;
  return result;
}

}  // namespace

bool Vicinity::contains(const Pose2& other) const {
  return (other.position() - T_map_base.position()).norm() < reach &&
         std::abs(wrap_angle(other.yaw - T_map_base.yaw)) < yaw_reach;
}

void GlobalSearch::restart(double usual) {
  min_explained_ = std::clamp(kMinOfUsual * usual, kMinEver, kMinExplained);
  recent_.clear();
  hypotheses_.clear();
  leader_.reset();
  searching_ = false;
  searches_ = 0;
}

void GlobalSearch::propose(const FrozenMap& map, const Pose2& T_map_base) {
  for (const Hypothesis& other : hypotheses_) {
    if (is_same(other.T_map_base, T_map_base)) return;
  }
  Hypothesis hypothesis;
  hypothesis.T_map_base = T_map_base;
  hypothesis.beams.assign(map, recent_.beams(), T_map_base);
  hypotheses_.push_back(std::move(hypothesis));
}

/// With what was seen so far. Places that explain it much worse than the best one known are not looked for.
void GlobalSearch::begin(const FrozenMap& map) {
  CorrelativeSearch::Request request;
  request.spread = hypotheses_.empty() ? kFirstSpread : kSpread;
  const std::vector<Eigen::Vector2d> points = thinned(points_, kSearchPoints);
  if (!hypotheses_.empty())
    request.min_score =
        std::max(request.min_score, map.rough.score(points, hypotheses_.front().T_map_base) - request.spread);
  search_.begin(map.rough, points, request);
  T_begin_now_ = {};
  refined_ = 0;
  searching_ = true;
  before_leader_ = false;
}

/// Proposes what the scans match near a place.
void GlobalSearch::refine(const FrozenMap& map, const Pose2& start) {
  MatchOptions rough = quick(map);
  rough.gate = map.coarse.cell();
  rough.range_sigma = map.fine.cell();
  const Match near = match(map.coarse, points_, start, start, Eigen::Matrix3d::Zero(), rough);
  const Match found =
      match(map.fine, points_, near.T_map_base, near.T_map_base, Eigen::Matrix3d::Zero(), quick(map));
  if (found.explained >= kHopeless) propose(map, found.T_map_base);
}

/// The place where the robot is expected, unless one there is followed already.
void GlobalSearch::look_near(const FrozenMap& map, const Vicinity& expected) {
  const auto is_near = [&](const Hypothesis& one) { return expected.contains(one.T_map_base); };
  if (std::none_of(hypotheses_.begin(), hypotheses_.end(), is_near)) refine(map, expected.T_map_base);
}

/// A slice of the search of the whole map, or of the closer look at what it has found.
void GlobalSearch::search(const FrozenMap& map, std::size_t evaluations) {
  if (searching_)
    T_begin_now_ = T_begin_now_ * recent_.step();
  else
    begin(map);
  if (!search_.ended()) {
    search_.advance(map.rough, evaluations);
    return;
  }
  const std::size_t end = std::min(search_.found().size(), refined_ + kRefinedPerScan);
  for (; refined_ < end; ++refined_) refine(map, search_.found()[refined_].T_map_base * T_begin_now_);
  if (refined_ < search_.found().size()) return;
  searching_ = false;
  unlisted_ = search_.unlisted();
  if (!before_leader_) ++searches_;
}

void GlobalSearch::follow(const FrozenMap& map) {
  for (Hypothesis& hypothesis : hypotheses_) {
    const Pose2 expected = hypothesis.T_map_base * recent_.step();
    const Match found = match(map.fine, points_, expected, expected, Eigen::Matrix3d::Zero(), quick(map));
    const Pose2 moved = expected.inverse() * found.T_map_base;
    const bool jumped = moved.position().norm() > 0.5 || std::abs(moved.yaw) > 0.3;
    hypothesis.T_map_base = jumped ? expected : found.T_map_base;
    hypothesis.beams.assign(map, recent_.beams(), hypothesis.T_map_base);
    ++hypothesis.scans;
    hypothesis.driven += recent_.step().position().norm();
  }
}

void GlobalSearch::merge() {
  std::stable_sort(hypotheses_.begin(), hypotheses_.end(), [](const Hypothesis& a, const Hypothesis& b) {
    return a.beams.evidence() > b.beams.evidence();
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < hypotheses_.size() && kept < kMaxHypotheses; ++i) {
    const auto end = hypotheses_.begin() + static_cast<std::ptrdiff_t>(kept);
    const bool doubled = std::any_of(hypotheses_.begin(), end, [&](const Hypothesis& other) {
      return is_same(other.T_map_base, hypotheses_[i].T_map_base);
    });
    if (doubled || hypotheses_[i].beams.explained() < kHopeless) continue;
    if (kept != i) std::swap(hypotheses_[kept], hypotheses_[i]);
    ++kept;
  }
  hypotheses_.resize(kept);
}

/// A new leader has to withstand whole searches of its own.
void GlobalSearch::follow_leader() {
  const bool same =
      leader_ && !hypotheses_.empty() && is_same(*leader_ * recent_.step(), hypotheses_.front().T_map_base);
  if (!same) {
    searches_ = 0;
    before_leader_ = true;
  }
  leader_.reset();
  if (!hypotheses_.empty()) leader_ = hypotheses_.front().T_map_base;
}

bool GlobalSearch::is_decided(const FrozenMap& map) const {
  if (searches_ < kMinSearches || hypotheses_.empty()) return false;
  const Hypothesis& leader = hypotheses_.front();
  if (leader.scans < kMinScans || leader.beams.explained() < min_explained_) return false;
  const double score = map.rough.score(thinned(points_, kSearchPoints), leader.T_map_base);
  if (score - unlisted_ < kClearScore) return false;
  return std::all_of(hypotheses_.begin() + 1, hypotheses_.end(), [&](const Hypothesis& other) {
    const ExplainedBeams::Comparison comparison = leader.beams.against(other.beams);
    return comparison.won - comparison.lost > kClearLead && comparison.won > kClearRatio * comparison.lost;
  });
}

bool GlobalSearch::leads_where_expected(const Vicinity& expected) const {
  if (hypotheses_.empty()) return false;
  const Hypothesis& leader = hypotheses_.front();
  return expected.contains(leader.T_map_base) && leader.scans >= kScansWhereExpected &&
         leader.driven >= kDrivenWhereExpected && leader.beams.explained() >= min_explained_;
}

std::optional<Pose2> GlobalSearch::add(const FrozenMap& map, const ScanPoints& scan, const Pose2& step,
                                       const std::optional<Vicinity>& expected) {
  if (scan.points.size() < kMinPoints || !recent_.add(scan, step)) {
    // What came before says nothing about where the robot is now.
    restart();
    return std::nullopt;
  }
  points_.clear();
  const std::vector<SeenBeam>& beams = recent_.beams();
  const std::size_t count = std::min(beams.size(), kFollowPoints);
  for (std::size_t i = 0; i < count; ++i) points_.push_back(beams[i * beams.size() / count].to);
  const double seconds = before_ ? (scan.stamp - *before_).seconds() : 0;
  before_ = scan.stamp;
  follow(map);
  if (expected) look_near(map, *expected);
  search(map,
         std::min(kMaxEvaluations, static_cast<std::size_t>(std::max(0.0, kEvaluationsPerSecond * seconds))));
  merge();
  follow_leader();
  if (!is_decided(map) && !(expected && leads_where_expected(*expected))) return std::nullopt;
  return hypotheses_.front().T_map_base;
}

}  // namespace parhelion::pose
