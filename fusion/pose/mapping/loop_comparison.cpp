#include "fusion/pose/mapping/loop_comparison.hpp"

#include <algorithm>

namespace parhelion::pose {
namespace {

constexpr std::size_t kEnoughScans = 3;
constexpr double kPointCost = 0.9;  ///< the largest that match() gives a point: one that contradicts the map
/// Chosen on 50 generated drives through long corridors (tests/fusion/pose/corridors.hpp, seeds 100 to 149).
constexpr double kSeen = 0.4;  ///< fraction of a scan's points that must lie where the map was seen
/// Of kPointCost: a point of a scan of which less was seen. Such a scan may fit the place or not.
constexpr double kUnseenCost = 0.15;
constexpr double kNear = 0.5;  ///< m: a smaller correction is no new place
constexpr double kSame = 0.2;  ///< m between two corrections of the same place
/// What has to be explained at the expected place, and at another, of what the recent path explains of the
/// same scans; and at least. Another place must explain no less than the expected one, too.
constexpr double kExplainedNear = 0.7, kExplainedFar = 0.95, kMinExplainedFar = 0.85;
/// By how much the cost of any other place must be higher: in units of cost, and of the best place's.
constexpr double kMargin = 8, kRelativeMargin = 0.15;
/// By how many times the scans must cost more at a place that is nearer to the expected one, if as many of
/// their points are explained there; else they must cost more at all. At the right place a cost is noise, and
/// twice as much where the map is bent by a decimetre or two.
constexpr double kRivalCost = 3;

}  // namespace

LoopComparison::LoopComparison(std::size_t index, std::vector<std::size_t> scans, double window)
    : index_(index),
      scans_(std::move(scans)),
      middle_(scans_.empty() ? 0 : scans_[scans_.size() / 2]),
      window_(window) {}

bool LoopComparison::step(const LoopSearch& search, Submap& submap) {
  if (scans_.size() < kEnoughScans) return true;
  if (!submap.surroundings || !submap.surroundings->is_complete()) {
    search.add_surroundings(submap);
    return false;
  }
  SubmapContext& around = *submap.surroundings;
  if (!around.likelihood) {
    constexpr int levels = 6;
    around.likelihood =
        std::make_unique<CorrelativeMap>(CorrelativeMap::begun(around.points, search.options().cell, levels));
    return false;
  }
  if (!around.likelihood->is_complete()) {
    around.likelihood->complete();
    return false;
  }
  if (!places_) begin_search(search, submap);
  if (hypotheses_.empty()) return search_places(search, submap) && hypotheses_.size() == 1;  // nothing found
  if (judged_ < hypotheses_.size()) {
    judge(search, submap, hypotheses_[judged_++]);
    if (judged_ == hypotheses_.size()) correction_ = only_correction(search);
    return judged_ == hypotheses_.size() && !correction_;
  }
  return match_scans(search, submap);
}

void LoopComparison::begin_search(const LoopSearch& search, const Submap& submap) {
  constexpr std::size_t points_of_scan = 60, places = 8;
  constexpr double min_score = 0.45, apart = 0.5, yaw_apart = 0.3;  // m, rad
  const Pose2 T_middle_map = search.poses()[middle_].inverse(), T_map_anchor = search.poses()[submap.anchor];
  std::vector<Eigen::Vector2d> points;
  for (std::size_t k : scans_) {
    const Pose2 T_middle_base = T_middle_map * search.poses()[k];
    for (const Eigen::Vector2d& p : thinned(search.keyframes()[k].scan.points, points_of_scan))
      points.push_back(T_middle_base * p);
  }
  const Pose2 expected = (T_middle_map * T_map_anchor).inverse();
  places_.emplace(*submap.surroundings->likelihood, points,
                  WindowSearch::Window{expected, window_, window_, search.options().angle_window},
                  WindowSearch::Request{min_score, places, apart, yaw_apart});
}

/// The expected place, and those where all scans together fit best. False: the search goes on.
bool LoopComparison::search_places(const LoopSearch& search, const Submap& submap) {
  constexpr std::size_t evaluations = 1000;  // of a part: half a millisecond
  if (!places_->advance(*submap.surroundings->likelihood, evaluations)) return false;
  const Pose2 T_middle_map = search.poses()[middle_].inverse(), T_map_anchor = search.poses()[submap.anchor];
  hypotheses_.emplace_back();
  for (const auto& found : places_->found())
    hypotheses_.emplace_back().correction = T_map_anchor * found.T_map_base * T_middle_map;
  return true;
}

LoopComparison::ScanFit LoopComparison::fit(const LoopSearch& search, const Submap& submap,
                                            std::size_t keyframe, const Pose2& correction) const {
  const std::vector<Eigen::Vector2d>& points = search.keyframes()[keyframe].scan.points;
  const SubmapContext& around = *submap.surroundings;
  const Pose2 T_map_anchor = search.poses()[submap.anchor], T_map_expected = search.poses()[keyframe];
  const Pose2 start = T_map_anchor.inverse() * (correction * T_map_expected);
  MatchOptions options = search.options().match;
  const Pose2 T_anchor_base =
      match(*around.surfels, points, start, start, Eigen::Matrix3d::Zero(), options).T_map_base;
  // A point where the map was never seen does not count.
  std::vector<Eigen::Vector2d> seen;
  for (const Eigen::Vector2d& p : points) {
    const Eigen::Vector2d q = T_anchor_base * p;
    if (around.surfels->nearest(q) != nullptr || around.seen.is_inside(q)) seen.push_back(p);
  }
  ScanFit result{T_map_anchor * T_anchor_base * T_map_expected.inverse(),
                 kUnseenCost * kPointCost * static_cast<double>(points.size())};
  const double part =
      points.empty() ? 0 : static_cast<double>(seen.size()) / static_cast<double>(points.size());
  if (part < kSeen) return result;
  options.iterations = 0;
  const Match there =
      match(*around.surfels, seen, T_anchor_base, T_anchor_base, Eigen::Matrix3d::Zero(), options);
  result.cost = there.cost / part;
  result.explained = there.explained;
  result.seen = true;
  return result;
}

void LoopComparison::judge(const LoopSearch& search, const Submap& submap, Hypothesis& hypothesis) const {
  constexpr double agreeing = 0.2;  // m
  std::vector<Pose2> corrections;
  for (std::size_t k : scans_) {
    const ScanFit found = fit(search, submap, k, hypothesis.correction);
    hypothesis.cost += found.cost;
    hypothesis.fits.push_back(found);
    hypothesis.explained += found.explained / static_cast<double>(scans_.size());
    if (found.explained >= search.options().min_explained) corrections.push_back(found.correction);
  }
  // That on which most scans agree: from a start nearby they slide to the place itself.
  for (const Pose2& seed : corrections) {
    const auto agree = std::count_if(corrections.begin(), corrections.end(), [&](const Pose2& other) {
      return is_same(search, seed, other, agreeing);
    });
    if (static_cast<std::size_t>(agree) <= hypothesis.scans) continue;
    hypothesis.scans = static_cast<std::size_t>(agree);
    hypothesis.correction = seed;
  }
  const double sigmas = moved(search, hypothesis.correction) / (window_ / 2);
  hypothesis.cost += sigmas * sigmas / 2;
}

double LoopComparison::moved(const LoopSearch& search, const Pose2& correction) const {
  const Eigen::Vector2d place = search.poses()[middle_].position();
  return (correction * place - place).norm();
}

bool LoopComparison::is_same(const LoopSearch& search, const Pose2& a, const Pose2& b,
                             double distance) const {
  constexpr double yaw = 0.06;  // rad
  const Eigen::Vector2d place = search.poses()[middle_].position();
  return std::abs(wrap_angle(a.yaw - b.yaw)) < yaw && (a * place - b * place).norm() < distance;
}

bool LoopComparison::is_enough(const LoopSearch& search, const Hypothesis& best) const {
  if (best.scans < std::max(kEnoughScans, 2 * scans_.size() / 3)) return false;
  double recent = 0;
  for (std::size_t k : scans_) recent += search.keyframes()[k].explained / static_cast<double>(scans_.size());
  if (moved(search, best.correction) < kNear) return best.explained >= kExplainedNear * recent;
  const double expected = hypotheses_.front().explained;
  return best.explained >= std::max({kMinExplainedFar, kExplainedFar * recent, expected});
}

/// Whether the scans speak for the other place, too, as far as the map has been seen there: nearly as many
/// points are explained, or they cost less.
bool LoopComparison::fits_too(const Hypothesis& other, const Hypothesis& best) const {
  std::size_t scans = 0;
  double explained = 0, explained_by_best = 0, cost = 0, cost_of_best = 0;
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    if (!other.fits[i].seen) continue;
    ++scans;
    explained += other.fits[i].explained, explained_by_best += best.fits[i].explained;
    cost += other.fits[i].cost, cost_of_best += best.fits[i].cost;
  }
  if (scans < 2 || 2 * scans < scans_.size()) return false;
  const bool as_many = explained >= kExplainedFar * explained_by_best;
  return cost < (as_many ? kRivalCost : 1) * cost_of_best;
}

/// By the expected place, or another that is much nearer to it.
bool LoopComparison::is_rivalled(const LoopSearch& search, const Hypothesis& best) const {
  const double far = moved(search, best.correction);
  return far >= kNear && std::any_of(hypotheses_.begin(), hypotheses_.end(), [&](const Hypothesis& other) {
           return moved(search, other.correction) < std::max(kNear, far / 2) &&
                  !is_same(search, other.correction, best.correction, kSame) && fits_too(other, best);
         });
}

/// Where all scans fit, if that is the only such place.
std::optional<Pose2> LoopComparison::only_correction(const LoopSearch& search) const {
  const auto best =
      std::min_element(hypotheses_.begin(), hypotheses_.end(),
                       [](const Hypothesis& a, const Hypothesis& b) { return a.cost < b.cost; });
  if (!is_enough(search, *best) || is_rivalled(search, *best)) return std::nullopt;
  const double margin = std::max(kMargin, kRelativeMargin * best->cost);
  for (const Hypothesis& other : hypotheses_) {
    if (!is_same(search, other.correction, best->correction, kSame) && other.cost < best->cost + margin)
      return std::nullopt;
  }
  return best->correction;
}

/// The submap first, then a scan at a time. True: that was the last.
bool LoopComparison::match_scans(const LoopSearch& search, Submap& submap) {
  if (!submap.complete) {
    search.add_surfels(submap);
    return false;
  }
  if (auto closure = search.matched(submap, index_, scans_[matched_], *correction_))
    closures_.push_back(std::move(*closure));
  return ++matched_ == scans_.size();
}

}  // namespace parhelion::pose
