#include "server/simulation/building/route_search.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::simulation {
namespace {

constexpr std::uint8_t kStartedHere = 8;
constexpr double kBeyond = 3.0;           // m around building, start and goal that paths may use
constexpr double kShortcutMargin = 0.10;  // m of additional clearance of a shortcut, if its ends have it

bool touches(const Footprint& point, const Footprint& other, double distance) {
  return distance_bound(point, other) < distance && signed_distance(point, other) < distance;
}

/// The lower estimate first; on a tie the one nearer to its goal; then by position.
bool later(const auto& a, const auto& b) {
  if (a.estimate != b.estimate) return a.estimate > b.estimate;
  if (a.cost != b.cost) return a.cost < b.cost;
  return a.cell.y != b.cell.y ? a.cell.y > b.cell.y : a.cell.x > b.cell.x;
}

}  // namespace

std::uint32_t RouteCost::factor(double clearance, double needed) {
  if (clearance < needed) return 0;
  const double nearness = std::clamp(1 - (clearance - needed) / kComfort, 0.0, 1.0);
  return kMinFactor + static_cast<std::uint32_t>(nearness * kMinFactor);
}

RouteSearch::RouteSearch(RouteGrid& grid, RouteQuery query, std::uint32_t number)
    : grid_(grid), query_(std::move(query)), number_(number), goal_(RouteGrid::cell_of(query_.goal)) {
  bounds_ = grid_.extent();
  bounds_.extend(query_.start).extend(query_.goal);
  bounds_.min().array() -= kBeyond;
  bounds_.max().array() += kBeyond;
  const RouteCell home = RouteGrid::cell_of(query_.start);
  if (factor(home) > 0) {
    reach(home, 0, kStartedHere);
    return;
  }
  // Too close to an obstacle: leave by the nearest free cell.
  const auto reach_cells = static_cast<std::int32_t>(kLeave / RouteGrid::kCell);
  double nearest = kLeave;
  RouteCell best = home;
  for (std::int32_t y = -reach_cells; y <= reach_cells; ++y) {
    for (std::int32_t x = -reach_cells; x <= reach_cells; ++x) {
      const RouteCell cell{home.x + x, home.y + y};
      const double distance = (RouteGrid::center(cell) - query_.start).norm();
      if (distance >= nearest || factor(cell) == 0) continue;
      nearest = distance;
      best = cell;
    }
  }
  if (!(best == home)) reach(best, 0, kStartedHere);
}

std::uint32_t RouteSearch::factor(const RouteCell& cell) {
  const RouteGrid::Place place = grid_.at(cell, made_);
  if (place.node == nullptr) too_large_ = true;
  const std::uint32_t factor = RouteCost::factor(static_cast<double>(place.clearance), query_.clearance);
  if (factor == 0 || query_.blocked.empty()) return factor;
  Footprint& point = scratch_;
  point.center = point.vertices[0] = RouteGrid::center(cell);
  for (const Footprint& other : query_.blocked) {
    if (touches(point, other, query_.clearance)) return 0;
  }
  return factor;
}

std::uint32_t RouteSearch::door_cost(const RouteCell& cell) const {
  if (query_.doors.empty()) return 0;
  const Footprint point = make_disc(RouteGrid::center(cell), 0);
  std::uint32_t cost = 0;
  for (const Footprint& door : query_.doors) {
    if (touches(point, door, RouteGrid::kCell)) cost += RouteCost::kDoorCost;
  }
  return cost;
}

std::uint32_t RouteSearch::distance(const RouteCell& cell) const {
  const auto dx = static_cast<std::uint32_t>(std::abs(cell.x - goal_.x));
  const auto dy = static_cast<std::uint32_t>(std::abs(cell.y - goal_.y));
  const std::uint32_t diagonal = std::min(dx, dy), straight = std::max(dx, dy) - diagonal;
  return RouteCost::kMinFactor * (RouteCost::kDiagonal * diagonal + RouteCost::kStraight * straight);
}

void RouteSearch::reach(const RouteCell& cell, std::uint32_t cost, std::uint8_t from) {
  RouteGrid::Node* node = grid_.at(cell, made_).node;
  if (node == nullptr) {
    too_large_ = true;
    return;
  }
  if (node->search == number_ && (node->closed || node->cost <= cost)) return;
  *node = {number_, cost, from, false};
  open_.push_back({cost + distance(cell), cost, cell});
  std::push_heap(open_.begin(), open_.end(), later<Open, Open>);
}

void RouteSearch::expand(const Open& at) {
  std::array<std::uint32_t, 8> factors{};
  for (std::size_t i = 0; i < kRouteSteps.size(); ++i) {
    const RouteStep& step = kRouteSteps[i];
    // A diagonal step needs both neighbours free: no cut corners.
    if (i >= 4 && (factors[i - 4] == 0 || factors[(i - 3) % 4] == 0)) continue;
    const RouteCell next{at.cell.x + step.x, at.cell.y + step.y};
    if (!bounds_.contains(RouteGrid::center(next))) continue;
    factors[i] = factor(next);
    if (factors[i] == 0) continue;
    reach(next, at.cost + step.length * factors[i] + door_cost(next), static_cast<std::uint8_t>(i));
  }
}

RouteSearch::Result RouteSearch::work(std::size_t& cells) {
  while (cells > 0 && !open_.empty()) {
    std::pop_heap(open_.begin(), open_.end(), later<Open, Open>);
    const Open at = open_.back();
    open_.pop_back();
    RouteGrid::Node& node = *grid_.at(at.cell, made_).node;
    if (node.closed) continue;
    node.closed = true;
    if (at.cell == goal_) {
      cost_ = at.cost;
      return Result::found;
    }
    made_ = 0;
    expand(at);
    cells -= std::min(cells, 1 + made_ * kTileWork);
  }
  if (!open_.empty()) return Result::searching;
  return too_large_ ? Result::too_large : Result::none;
}

std::vector<Eigen::Vector2d> RouteSearch::cells() {
  std::vector<Eigen::Vector2d> points{query_.goal};
  RouteCell cell = goal_;
  while (true) {
    const RouteGrid::Node& node = *grid_.at(cell, made_).node;
    points.push_back(RouteGrid::center(cell));
    if (node.from == kStartedHere) break;
    const RouteStep& step = kRouteSteps[node.from];
    cell = {cell.x - step.x, cell.y - step.y};
  }
  points.push_back(query_.start);
  std::reverse(points.begin(), points.end());
  return points;
}

bool RouteSearch::has_free_path(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  constexpr double max_length = 12.0;  // m: longer shortcuts take long to check without benefit
  if ((to - from).norm() > max_length) return false;
  const double ends = std::min(grid_.clearance(from), grid_.clearance(to));
  const double needed = std::clamp(ends, query_.clearance, query_.clearance + kShortcutMargin);
  const Footprint path = make_segment(from, to, 0);
  const auto meets = [&](const Footprint& other) { return touches(path, other, query_.clearance); };
  // Closed doors are crossed at their middle: the path through one keeps its cells.
  if (std::any_of(query_.blocked.begin(), query_.blocked.end(), meets)) return false;
  if (std::any_of(query_.doors.begin(), query_.doors.end(), meets)) return false;
  return grid_.free_segment(from, to, needed);
}

std::vector<Eigen::Vector2d> RouteSearch::smooth() {
  const std::vector<Eigen::Vector2d> path = cells();
  std::vector<Eigen::Vector2d> points{path.front()};
  std::size_t at = 0;
  while (at + 1 < path.size()) {
    // The farthest visible point, by doubling and bisection: visibility is almost monotone, which suffices.
    std::size_t seen = at + 1, reach = 2;
    while (at + reach < path.size() && has_free_path(path[at], path[at + reach])) {
      seen = at + reach;
      reach *= 2;
    }
    std::size_t unseen = std::min(at + reach, path.size());
    while (seen + 1 < unseen) {
      const std::size_t middle = (seen + unseen) / 2;
      (has_free_path(path[at], path[middle]) ? seen : unseen) = middle;
    }
    points.push_back(path[seen]);
    at = seen;
  }
  return points;
}

}  // namespace parhelion::simulation
