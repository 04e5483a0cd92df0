#include "server/simulation/building/route_grid.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::simulation {
namespace {

std::int32_t floor_div(std::int32_t a, std::int32_t b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

double to_nearest(const Eigen::Vector2d& p, const std::vector<const FixedObstacle*>& near, Footprint& point) {
  point.center = point.vertices[0] = p;
  double smallest = RouteGrid::kMaxClearance;
  for (const FixedObstacle* obstacle : near) {
    if (obstacle->label == EntityLabel::door || distance_bound(point, obstacle->footprint) >= smallest)
      continue;
    smallest = std::min(smallest, signed_distance(point, obstacle->footprint));
  }
  return smallest;
}

}  // namespace

RouteCell RouteGrid::cell_of(const Eigen::Vector2d& p) {
  return {static_cast<std::int32_t>(std::floor(p.x() / kCell)),
          static_cast<std::int32_t>(std::floor(p.y() / kCell))};
}

Eigen::Vector2d RouteGrid::center(const RouteCell& cell) {
  return {(cell.x + 0.5) * kCell, (cell.y + 0.5) * kCell};
}

RouteGrid::Place RouteGrid::at(const RouteCell& cell, std::size_t& made) {
  const RouteCell tile{floor_div(cell.x, kTile), floor_div(cell.y, kTile)};
  const std::uint64_t key =
      std::uint64_t{static_cast<std::uint32_t>(tile.x)} << 32 | static_cast<std::uint32_t>(tile.y);
  if (newest_ == nullptr || key != newest_key_) {
    const auto known = tiles_.find(key);
    if (known == tiles_.end()) {
      if (tiles_.size() == kMaxTiles) return {0, nullptr};
      ++made;
      newest_ = tiles_.emplace(key, make(tile)).first->second.get();
    } else {
      newest_ = known->second.get();
    }
    newest_key_ = key;
  }
  const auto index = static_cast<std::size_t>((cell.y - tile.y * kTile) * kTile + cell.x - tile.x * kTile);
  return {newest_->clearance[index], &newest_->nodes[index]};
}

RouteGrid::Tile* RouteGrid::make(const RouteCell& tile) {
  auto* fresh = new Tile;
  const double side = kTile * kCell;
  const Eigen::Vector2d middle((tile.x + 0.5) * side, (tile.y + 0.5) * side);
  near_.clear();
  building_->near(middle, side * 0.71 + kMaxClearance, bottom_, top_, near_);
  Footprint point = make_disc(middle, 0);
  for (std::int32_t row = 0; row < kTile; ++row) {
    for (std::int32_t column = 0; column < kTile; ++column) {
      const RouteCell cell{tile.x * kTile + column, tile.y * kTile + row};
      fresh->clearance[static_cast<std::size_t>(row * kTile + column)] =
          static_cast<float>(to_nearest(center(cell), near_, point));
    }
  }
  return fresh;
}

double RouteGrid::clearance(const Eigen::Vector2d& p) {
  near_.clear();
  building_->near(p, kMaxClearance, bottom_, top_, near_);
  Footprint point = make_disc(p, 0);
  return to_nearest(p, near_, point);
}

/// The clearance changes by at most the distance moved: a step of the remaining clearance is safe.
std::optional<double> RouteGrid::first_too_close(const Eigen::Vector2d& from,
                                                 const Eigen::Vector2d& direction, double limit,
                                                 double needed) {
  constexpr double tolerance = 0.001;  // m
  double s = 0;
  while (true) {
    const double spare = clearance(from + s * direction) - needed + tolerance;
    if (spare < 0) return s;
    if (s >= limit) return std::nullopt;
    s = std::min(limit, s + std::max(spare, tolerance));
  }
}

double RouteGrid::free_distance(const Eigen::Vector2d& from, const Eigen::Vector2d& direction, double limit,
                                double needed) {
  return first_too_close(from, direction, limit, needed).value_or(limit);
}

bool RouteGrid::free_segment(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double needed) {
  const double length = (to - from).norm();
  const Eigen::Vector2d direction = length > 0 ? Eigen::Vector2d((to - from) / length) : to - from;
  return !first_too_close(from, direction, length, needed);
}

}  // namespace parhelion::simulation
