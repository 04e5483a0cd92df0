#include "fusion/pose/matching/surfel_map.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace parhelion::pose {
namespace {

/// Eigenvalues in ascending order and the eigenvector of the smaller one, in closed form.
struct Axes {
  double small, large;
  Eigen::Vector2d normal;
};
Axes axes(double xx, double xy, double yy) {
  const double mean = (xx + yy) / 2, half = (xx - yy) / 2;
  const double radius = std::sqrt(half * half + xy * xy);
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
  return {std::max(0.0, mean - radius), mean + radius, {-std::sin(angle), std::cos(angle)}};
}

}  // namespace

double through_variance(double cell) { return 0.75 * cell * cell; }

SurfelMap::SurfelMap(double cell) : cell_(cell) {}

SurfelMap::Cell* SurfelMap::find(std::int64_t cx, std::int64_t cy) const {
  const std::int64_t tx = (cx >> kTileBits) - tx0_, ty = (cy >> kTileBits) - ty0_;
  if (tx < 0 || ty < 0 || tx >= tiles_x_ || ty >= tiles_y_) return nullptr;
  Tile* tile = tiles_[static_cast<std::size_t>(ty * tiles_x_ + tx)].get();
  if (tile == nullptr) return nullptr;
  return &tile->cells[static_cast<std::size_t>(((cy & kInTile) << kTileBits) | (cx & kInTile))];
}

void SurfelMap::grow(std::int64_t tx, std::int64_t ty) {
  constexpr std::int64_t spare = 4;
  const bool first = tiles_.empty();
  const std::int64_t x0 = first ? tx - spare : std::min(tx0_, tx - spare);
  const std::int64_t y0 = first ? ty - spare : std::min(ty0_, ty - spare);
  const std::int64_t x1 = first ? tx + spare + 1 : std::max(tx0_ + tiles_x_, tx + spare + 1);
  const std::int64_t y1 = first ? ty + spare + 1 : std::max(ty0_ + tiles_y_, ty + spare + 1);
  std::vector<std::unique_ptr<Tile>> tiles(static_cast<std::size_t>((x1 - x0) * (y1 - y0)));
  for (std::int64_t y = 0; y < tiles_y_; ++y) {
    for (std::int64_t x = 0; x < tiles_x_; ++x) {
      tiles[static_cast<std::size_t>((y + ty0_ - y0) * (x1 - x0) + x + tx0_ - x0)] =
          std::move(tiles_[static_cast<std::size_t>(y * tiles_x_ + x)]);
    }
  }
  tiles_ = std::move(tiles);
  tx0_ = x0, ty0_ = y0, tiles_x_ = x1 - x0, tiles_y_ = y1 - y0;
}

SurfelMap::Cell& SurfelMap::make(std::int64_t cx, std::int64_t cy) {
  const std::int64_t tx = cx >> kTileBits, ty = cy >> kTileBits;
  if (tx < tx0_ || ty < ty0_ || tx >= tx0_ + tiles_x_ || ty >= ty0_ + tiles_y_) grow(tx, ty);
  auto& tile = tiles_[static_cast<std::size_t>((ty - ty0_) * tiles_x_ + tx - tx0_)];
  if (!tile) tile = std::make_unique<Tile>(), ++made_;
  return *find(cx, cy);
}

void SurfelMap::add(std::span<const Eigen::Vector2d> points_base, const Pose2& T_map_base, double weight) {
  const double c = std::cos(T_map_base.yaw), s = std::sin(T_map_base.yaw);
  Cell* last = nullptr;  // neighbouring beams often end in the same cell
  std::int64_t last_cx = 0, last_cy = 0;
  for (const Eigen::Vector2d& p : points_base) {
    const Eigen::Vector2d q(T_map_base.x + c * p.x() - s * p.y(), T_map_base.y + s * p.x() + c * p.y());
    const std::int64_t cx = cell_of(q.x(), cell_), cy = cell_of(q.y(), cell_);
    if (last == nullptr || cx != last_cx || cy != last_cy) {
      last = &make(cx, cy);
      last_cx = cx, last_cy = cy;
      mark_stale(*last, cx, cy);
    }
    Cell& cell = *last;
    const double dx = q.x() - (static_cast<double>(cx) + 0.5) * cell_,
                 dy = q.y() - (static_cast<double>(cy) + 0.5) * cell_;
    cell.n += weight;
    cell.x += weight * dx, cell.y += weight * dy;
    cell.xx += weight * dx * dx, cell.xy += weight * dx * dy, cell.yy += weight * dy * dy;
    // Rounding must not leave residues where all points were removed.
    if (cell.n < 0.5) cell.n = cell.x = cell.y = cell.xx = cell.xy = cell.yy = 0;
  }
}

void SurfelMap::add(const Moments& moments) {
  Cell& cell = make(moments.column, moments.row);
  cell.n += moments.n;
  cell.x += moments.x, cell.y += moments.y;
  cell.xx += moments.xx, cell.xy += moments.xy, cell.yy += moments.yy;
  mark_stale(cell, moments.column, moments.row);
}

/// The surfels that contain the cell's points.
void SurfelMap::mark_stale(Cell& cell, std::int64_t cx, std::int64_t cy) {
  const bool inside = has_neighbours_in_tile(cx, cy);
  for (std::int64_t y = -1; y <= 1; ++y) {
    for (std::int64_t x = -1; x <= 1; ++x) {
      Cell* neighbour = inside ? &cell + y * kTileCells + x : find(cx + x, cy + y);
      if (neighbour != nullptr) neighbour->stale = true;
    }
  }
}

template <class Visit>
void SurfelMap::for_each_cell(Visit visit) const {
  for (std::int64_t t = 0; t < tiles_x_ * tiles_y_; ++t) {
    Tile* tile = tiles_[static_cast<std::size_t>(t)].get();
    if (tile == nullptr) continue;
    const std::int64_t x0 = (tx0_ + t % tiles_x_) * kTileCells, y0 = (ty0_ + t / tiles_x_) * kTileCells;
    for (std::int64_t i = 0; i < kTileCells * kTileCells; ++i)
      visit(tile->cells[static_cast<std::size_t>(i)], x0 + i % kTileCells, y0 + i / kTileCells);
  }
}

std::vector<SurfelMap::Moments> SurfelMap::moments() const {
  std::vector<Moments> all;
  for_each_cell([&](const Cell& cell, std::int64_t cx, std::int64_t cy) {
    if (cell.n > 0)
      all.push_back({static_cast<std::int32_t>(cx), static_cast<std::int32_t>(cy), cell.n, cell.x, cell.y,
                     cell.xx, cell.xy, cell.yy});
  });
  return all;
}

void SurfelMap::finish() {
  for_each_cell([this](Cell& cell, std::int64_t cx, std::int64_t cy) {
    if (cell.stale) refresh(cell, cx, cy);
  });
}

void SurfelMap::refresh(Cell& cell, std::int64_t cx, std::int64_t cy) const {
  constexpr double enough_points = 5;
  constexpr double flat_ratio = 0.15;
  // Of the variance along a surface through all three cells: chosen on generated houses with a depth camera.
  constexpr double thick_ratio = 0.5, thick_extent = 0.6;
  // As if so many more points were spread over a cell: one or two say little of where a surface is along
  // itself, and would hold a robot in a tunnel. Chosen on generated tunnels.
  constexpr double unseen_points = 2;
  cell.stale = false;
  cell.valid = false;
  if (cell.n <= 0) return;
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  const bool inside = has_neighbours_in_tile(cx, cy);
  for (std::int64_t j = -1; j <= 1; ++j) {
    for (std::int64_t i = -1; i <= 1; ++i) {
      const Cell* other = inside ? &cell + j * kTileCells + i : find(cx + i, cy + j);
      if (other == nullptr || other->n <= 0) continue;
      const double ox = static_cast<double>(i) * cell_, oy = static_cast<double>(j) * cell_;
      n += other->n;
      x += other->x + other->n * ox, y += other->y + other->n * oy;
      xx += other->xx + 2 * ox * other->x + other->n * ox * ox;
      yy += other->yy + 2 * oy * other->y + other->n * oy * oy;
      xy += other->xy + ox * other->y + oy * other->x + other->n * ox * oy;
    }
  }
  const double mx = x / n, my = y / n;
  const double cxx = xx / n - mx * mx, cxy = xy / n - mx * my, cyy = yy / n - my * my;
  const Axes a = axes(cxx, cxy, cyy);
  Surfel& surfel = cell.surfel;
  surfel.mean = {(static_cast<double>(cx) + 0.5) * cell_ + mx, (static_cast<double>(cy) + 0.5) * cell_ + my};
  surfel.normal = a.normal;
  const double unseen = unseen_points / (n + unseen_points) * cell_ * cell_;
  surfel.covariance << cxx + unseen, cxy, cxy, cyy + unseen;
  surfel.thickness = std::sqrt(a.small);
  surfel.points = static_cast<float>(n);
  surfel.flat = n >= enough_points && a.small < flat_ratio * a.large;
  surfel.thick = !surfel.flat && n >= enough_points && a.small < thick_ratio * a.large &&
                 a.large > thick_extent * through_variance(cell_);
  cell.valid = true;
}

const Surfel* SurfelMap::surfel(Cell& cell, std::int64_t cx, std::int64_t cy) const {
  if (cell.stale) refresh(cell, cx, cy);
  return cell.valid ? &cell.surfel : nullptr;
}

const Surfel* SurfelMap::nearest(const Eigen::Vector2d& p_map) const {
  const std::int64_t cx = cell_of(p_map.x(), cell_), cy = cell_of(p_map.y(), cell_);
  Cell* own = find(cx, cy);
  if (own != nullptr) {
    if (const Surfel* found = surfel(*own, cx, cy)) return found;
  }
  const bool inside = has_neighbours_in_tile(cx, cy);
  if (inside && own == nullptr) return nullptr;
  const Surfel* best = nullptr;
  double best_distance = 0;
  for (std::int64_t y = -1; y <= 1; ++y) {
    for (std::int64_t x = -1; x <= 1; ++x) {
      Cell* cell = inside ? own + y * kTileCells + x : find(cx + x, cy + y);
      const Surfel* candidate = cell == nullptr ? nullptr : surfel(*cell, cx + x, cy + y);
      if (candidate == nullptr) continue;
      const double distance = (candidate->mean - p_map).squaredNorm();
      if (best == nullptr || distance < best_distance) best = candidate, best_distance = distance;
    }
  }
  return best;
}

const Surfel* SurfelMap::nearest_slow(const Eigen::Vector2d& p_map) const {
  const std::int64_t cx = cell_of(p_map.x(), cell_), cy = cell_of(p_map.y(), cell_);
  const Surfel* best = nullptr;
  double best_distance = 0;
  for (std::int64_t y = ty0_ * kTileCells; y < (ty0_ + tiles_y_) * kTileCells; ++y) {
    for (std::int64_t x = tx0_ * kTileCells; x < (tx0_ + tiles_x_) * kTileCells; ++x) {
      if (std::abs(x - cx) > 1 || std::abs(y - cy) > 1) continue;
      Cell* cell = find(x, y);
      if (cell == nullptr) continue;
      refresh(*cell, x, y);
      if (!cell->valid) continue;
      if (x == cx && y == cy) return &cell->surfel;
      const double distance = (cell->surfel.mean - p_map).squaredNorm();
      if (best == nullptr || distance < best_distance) best = &cell->surfel, best_distance = distance;
    }
  }
  return best;
}

}  // namespace parhelion::pose
