#include "fusion/pose/matching/window_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace parhelion::pose {

double WindowSearch::Places::bound() const {
  return found.size() < request.count ? request.min_score : std::max(request.min_score, found.back().score);
}

void WindowSearch::Places::take(const Candidate& candidate) {
  const auto near = [&](const Candidate& other) {
    return (other.T_map_base.position() - candidate.T_map_base.position()).norm() < request.distinct &&
           std::abs(wrap_angle(other.T_map_base.yaw - candidate.T_map_base.yaw)) < request.distinct_angle;
  };
  for (const Candidate& other : found) {
    if (near(other) && other.score >= candidate.score) return;
  }
  std::erase_if(found, near);
  const auto place =
      std::upper_bound(found.begin(), found.end(), candidate,
                       [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  found.insert(place, candidate);
  if (found.size() > request.count) found.pop_back();
}

WindowSearch::WindowSearch(const CorrelativeMap& map, std::span<const Eigen::Vector2d> points_base,
                           const Window& window, const Request& request)
    : window_(window),
      places_{request, {}},
      points_(points_base.begin(), points_base.end()),
      reach_x_(static_cast<int>(std::ceil(window.reach_x / map.resolution_))),
      reach_y_(static_cast<int>(std::ceil(window.reach_y / map.resolution_))),
      yaws_(map.yaws(points_base, window)) {
  while (top_ + 1 < map.levels_ && (1 << top_) < 2 * std::min(reach_x_, reach_y_)) ++top_;
}

bool WindowSearch::advance(const CorrelativeMap& map, std::size_t evaluations) {
  std::size_t spent = 0;
  while (turned_.size() < yaws_.size()) {
    if (spent >= evaluations) return false;
    spent += cover(map);
    if (turned_.size() == yaws_.size())
      std::stable_sort(roots_.begin(), roots_.end(),
                       [](const Square& a, const Square& b) { return a.score > b.score; });
  }
  for (;;) {
    if (open_.empty()) {
      if (next_root_ == roots_.size() || roots_[next_root_].score <= places_.bound()) return true;
      open_.push_back(roots_[next_root_++]);
    }
    if (spent >= evaluations) return false;
    const Square square = open_.back();
    open_.pop_back();
    if (square.score > places_.bound()) spent += branch(map, square);
  }
}

/// The squares of the next heading. Its evaluations, of which turning the points counts as one.
std::size_t WindowSearch::cover(const CorrelativeMap& map) {
  const std::size_t yaw = turned_.size();
  turned_.push_back(map.rotated(points_, yaws_[yaw], window_.centre));
  std::size_t evaluations = 1;
  for (int y = -reach_y_; y <= reach_y_; y += 1 << top_) {
    for (int x = -reach_x_; x <= reach_x_; x += 1 << top_, ++evaluations) {
      const double bound = map.score(turned_[yaw], {x, y}, top_);
      if (bound > places_.request.min_score) roots_.push_back({yaw, {x, y}, top_, bound});
    }
  }
  return evaluations;
}

std::size_t WindowSearch::branch(const CorrelativeMap& map, const Square& square) {
  if (square.level == 0) {
    places_.take({{window_.centre.x + square.shift.x * map.resolution_,
                   window_.centre.y + square.shift.y * map.resolution_, wrap_angle(yaws_[square.yaw])},
                  square.score});
    return 0;
  }
  const int half = 1 << (square.level - 1);
  const auto first = static_cast<std::ptrdiff_t>(open_.size());
  for (const Offset step : std::array<Offset, 4>{{{half, half}, {0, half}, {half, 0}, {0, 0}}}) {
    const Offset child{square.shift.x + step.x, square.shift.y + step.y};
    if (child.x > reach_x_ || child.y > reach_y_) continue;
    open_.push_back(
        {square.yaw, child, square.level - 1, map.score(turned_[square.yaw], child, square.level - 1)});
  }
  std::stable_sort(open_.begin() + first, open_.end(),
                   [](const Square& a, const Square& b) { return a.score < b.score; });
  return open_.size() - static_cast<std::size_t>(first);
}

}  // namespace parhelion::pose
