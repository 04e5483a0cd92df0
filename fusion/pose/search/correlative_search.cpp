#include "fusion/pose/search/correlative_search.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace parhelion::pose {
namespace {

constexpr double kScale = 65280;  ///< of scores as integers: 255 * 256
/// Between two headings the points of a scan move by less than this fraction of a cell, but for the farthest
/// quarter of them.
constexpr double kCellsBetweenYaws = 1.5;
constexpr double kMinYawStep = 0.012, kMaxYawStep = 0.06;  ///< rad

double yaw_step(std::span<const Eigen::Vector2d> points, double resolution) {
  std::vector<double> ranges;
  ranges.reserve(points.size());
  for (const Eigen::Vector2d& p : points) ranges.push_back(p.norm());
  const auto far = ranges.begin() + static_cast<std::ptrdiff_t>(3 * ranges.size() / 4);
  std::nth_element(ranges.begin(), far, ranges.end());
  return std::clamp(kCellsBetweenYaws * resolution / std::max(*far, 0.1), kMinYawStep, kMaxYawStep);
}

}  // namespace

void CorrelativeSearch::begin(const CorrelativeMap& map, std::span<const Eigen::Vector2d> points_base,
                              const Request& request) {
  request_ = request;
  points_.assign(points_base.begin(), points_base.end());
  roots_.clear();
  open_.clear();
  found_.clear();
  roots_.reserve(request.max_roots);
  unlisted_ = request.min_score;
  evaluations_ = 0;
  turned_to_ = -1;
  next_yaw_ = next_x_ = next_y_ = 0;
  top_ = map.levels_ - 1;
  stage_ = points_.empty() ? Stage::ended : Stage::covering;
  if (!points_.empty())
    yaws_ = static_cast<int>(std::ceil(2 * std::numbers::pi / yaw_step(points_, map.resolution_)));
}

bool CorrelativeSearch::is_worse(const Square& a, const Square& b) {
  return std::tie(a.bound, b.yaw, b.y, b.x) < std::tie(b.bound, a.yaw, a.y, a.x);
}

bool CorrelativeSearch::advance(const CorrelativeMap& map, std::size_t evaluations) {
  std::size_t budget = evaluations;
  if (stage_ == Stage::covering && cover(map, budget)) {
    std::make_heap(roots_.begin(), roots_.end(), is_worse);
    stage_ = Stage::descending;
  }
  if (stage_ == Stage::descending) descend(map, budget);
  return ended();
}

void CorrelativeSearch::turn(const CorrelativeMap& map, std::uint16_t yaw) {
  if (turned_to_ == yaw) return;
  turned_to_ = yaw;
  const double angle = 2 * std::numbers::pi * yaw / yaws_, c = std::cos(angle), s = std::sin(angle);
  turned_.clear();
  for (const Eigen::Vector2d& p : points_)
    turned_.push_back({static_cast<int>(std::floor((c * p.x() - s * p.y()) / map.resolution_ + 0.5)),
                       static_cast<int>(std::floor((s * p.x() + c * p.y()) / map.resolution_ + 0.5))});
}

std::uint16_t CorrelativeSearch::bound_of(const CorrelativeMap& map, int x, int y, int level) {
  ++evaluations_;
  return static_cast<std::uint16_t>(kScale * map.score(turned_, {x, y}, level));
}

/// A bound below this cannot give a candidate that is listed.
double CorrelativeSearch::needed() const {
  double score = request_.min_score;
  if (!found_.empty()) score = std::max(score, found_.front().score - request_.spread);
  if (found_.size() == request_.count) score = std::max(score, found_.back().score);
  return kScale * score;
}

/// The bounds of all squares of the top level. False: the budget is used up.
bool CorrelativeSearch::cover(const CorrelativeMap& map, std::size_t& budget) {
  const int side = 1 << top_;
  for (; next_yaw_ < yaws_; ++next_yaw_, next_y_ = 0) {
    turn(map, static_cast<std::uint16_t>(next_yaw_));
    for (; next_y_ < map.height_; next_y_ += side, next_x_ = 0) {
      for (; next_x_ < map.width_; next_x_ += side) {
        if (budget == 0) return false;
        --budget;
        const std::uint16_t bound = bound_of(map, next_x_, next_y_, top_);
        if (bound <= kScale * unlisted_) continue;
        if (roots_.size() == request_.max_roots) drop_worse_half();
        roots_.push_back({bound, static_cast<std::uint16_t>(next_yaw_), top_, next_x_, next_y_});
      }
    }
  }
  return true;
}

void CorrelativeSearch::drop_worse_half() {
  const auto middle = roots_.begin() + static_cast<std::ptrdiff_t>(roots_.size() / 2);
  std::nth_element(roots_.begin(), middle, roots_.end(),
                   [](const Square& a, const Square& b) { return a.bound > b.bound; });
  const std::uint16_t cut = middle->bound;
  std::erase_if(roots_, [&](const Square& root) { return root.bound <= cut; });
  unlisted_ = std::max(unlisted_, cut / kScale);
}

void CorrelativeSearch::descend(const CorrelativeMap& map, std::size_t& budget) {
  constexpr std::size_t dearest = 5;  // evaluations of one step, with turning the scan
  while (budget >= dearest) {
    if (open_.empty()) {
      const bool over = roots_.empty() || roots_.front().bound <= needed();
      if (over || evaluations_ >= request_.max_evaluations) {
        if (!over) unlisted_ = std::max(unlisted_, roots_.front().bound / kScale);
        if (found_.size() == request_.count) unlisted_ = std::max(unlisted_, found_.back().score);
        stage_ = Stage::ended;
        return;
      }
      std::pop_heap(roots_.begin(), roots_.end(), is_worse);
      open_.push_back(roots_.back());
      roots_.pop_back();
    }
    const Square square = open_.back();
    open_.pop_back();
    if (square.bound <= needed()) continue;
    if (turned_to_ != square.yaw) --budget;
    turn(map, square.yaw);
    if (square.level == 0)
      take(map, square);
    else
      branch(map, square, budget);
  }
}

void CorrelativeSearch::branch(const CorrelativeMap& map, const Square& square, std::size_t& budget) {
  const int level = square.level - 1, half = 1 << level;
  const std::size_t first = open_.size();
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const int x = square.x + i * half, y = square.y + j * half;
      if (x >= map.width_ || y >= map.height_) continue;
      --budget;
      open_.push_back({bound_of(map, x, y, level), square.yaw, level, x, y});
    }
  }
  std::stable_sort(open_.begin() + static_cast<std::ptrdiff_t>(first), open_.end(),
                   [](const Square& a, const Square& b) { return a.bound < b.bound; });
}

void CorrelativeSearch::take(const CorrelativeMap& map, const Square& square) {
  const Candidate candidate{
      {map.x_min_ + (square.x + 0.5) * map.resolution_, map.y_min_ + (square.y + 0.5) * map.resolution_,
       wrap_angle(2 * std::numbers::pi * square.yaw / yaws_)},
      square.bound / kScale};
  const auto near = [&](const Candidate& other) {
    return (other.T_map_base.position() - candidate.T_map_base.position()).norm() < request_.distinct &&
           std::abs(wrap_angle(other.T_map_base.yaw - candidate.T_map_base.yaw)) < request_.distinct_angle;
  };
  for (const Candidate& other : found_) {
    if (near(other) && other.score >= candidate.score) return;
  }
  std::erase_if(found_, near);
  const auto place =
      std::upper_bound(found_.begin(), found_.end(), candidate,
                       [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  found_.insert(place, candidate);
  if (found_.size() > request_.count) found_.pop_back();
}

}  // namespace parhelion::pose
