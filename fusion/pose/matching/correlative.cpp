#include "fusion/pose/matching/correlative.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "fusion/pose/matching/window_search.hpp"

namespace parhelion::pose {
namespace {

constexpr double kKernelCells = 3;  ///< radius of a point's likelihood

/// own[i] = max(own[i], other[i]); they do not overlap. Several cells at a time.
void raise_to(std::uint8_t* __restrict own, const std::uint8_t* __restrict other, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) own[i] = std::max(own[i], other[i]);
}

/// The maximum over the step x step cells that begin at each cell, of a grid that has the maximum over half
/// of that along each side. `half`: cells.
std::vector<std::uint8_t> widened(const std::vector<std::uint8_t>& grid, std::size_t width,
                                  std::size_t height, std::size_t half) {
  std::vector<std::uint8_t> wide = grid;
  for (std::size_t y = 0; y < height && half < width; ++y)
    raise_to(&wide[y * width], &grid[y * width + half], width - half);
  for (std::size_t y = 0; y + half < height; ++y)
    raise_to(&wide[y * width], &wide[(y + half) * width], width);
  return wide;
}

}  // namespace

CorrelativeMap::CorrelativeMap(std::span<const Eigen::Vector2d> points_map, double resolution, int levels,
                               double sigma_cells)
    : CorrelativeMap(points_map, resolution, levels, Finest{sigma_cells}) {
  complete();
}

CorrelativeMap CorrelativeMap::begun(std::span<const Eigen::Vector2d> points_map, double resolution,
                                     int levels) {
  return {points_map, resolution, levels, Finest{kSigmaCells}};
}

void CorrelativeMap::complete() {
  for (std::size_t h = grids_.size(); h < static_cast<std::size_t>(levels_); ++h)
    grids_.push_back(widened(grids_.back(), static_cast<std::size_t>(width_),
                             static_cast<std::size_t>(height_), std::size_t{1} << (h - 1)));
}

CorrelativeMap::CorrelativeMap(std::span<const Eigen::Vector2d> points_map, double resolution, int levels,
                               Finest finest)
    : resolution_(resolution), levels_(levels) {
  Eigen::Vector2d low(0, 0), high(0, 0);
  if (!points_map.empty()) low = high = points_map.front();
  for (const Eigen::Vector2d& p : points_map) low = low.cwiseMin(p), high = high.cwiseMax(p);
  // A margin on the low side: the maxima extend from a cell to higher ones, so a square may begin outside.
  const double margin = resolution * ((1 << (levels - 1)) + kKernelCells);
  x_min_ = low.x() - margin, y_min_ = low.y() - margin;
  width_ = static_cast<int>((high.x() - x_min_) / resolution + kKernelCells) + 2;
  height_ = static_cast<int>((high.y() - y_min_) / resolution + kKernelCells) + 2;
  std::vector<std::uint8_t> grid(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0);
  const int k = static_cast<int>(kKernelCells);
  std::array<std::array<std::uint8_t, 7>, 7> kernel{};
  for (int j = -k; j <= k; ++j) {
    for (int i = -k; i <= k; ++i) {
      kernel[static_cast<std::size_t>(j + k)][static_cast<std::size_t>(i + k)] = static_cast<std::uint8_t>(
          std::lround(255 * std::exp(-0.5 * (i * i + j * j) / (finest.sigma_cells * finest.sigma_cells))));
    }
  }
  for (const Eigen::Vector2d& p : points_map) {
    const int cx = static_cast<int>((p.x() - x_min_) / resolution),
              cy = static_cast<int>((p.y() - y_min_) / resolution);
    auto& centre =
        grid[static_cast<std::size_t>(cy) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(cx)];
    if (centre == 255) continue;
    for (int j = -k; j <= k; ++j) {
      for (int i = -k; i <= k; ++i) {
        auto& cell = grid[static_cast<std::size_t>(cy + j) * static_cast<std::size_t>(width_) +
                          static_cast<std::size_t>(cx + i)];
        cell = std::max(cell, kernel[static_cast<std::size_t>(j + k)][static_cast<std::size_t>(i + k)]);
      }
    }
  }
  grids_.push_back(std::move(grid));
}

bool CorrelativeMap::has_point(const Eigen::Vector2d& p_map) const {
  const int x = static_cast<int>(std::floor((p_map.x() - x_min_) / resolution_)),
            y = static_cast<int>(std::floor((p_map.y() - y_min_) / resolution_));
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return false;
  return grids_.front()[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                        static_cast<std::size_t>(x)] == 255;
}

double CorrelativeMap::score(const std::vector<Offset>& cells, Offset shift, int level) const {
  const std::vector<std::uint8_t>& grid = grids_[static_cast<std::size_t>(level)];
  std::int64_t sum = 0;
  for (const Offset& cell : cells) {
    const int x = cell.x + shift.x, y = cell.y + shift.y;
    if (x < 0 || y < 0 || x >= width_ || y >= height_) continue;
    sum += grid[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  }
  return cells.empty() ? 0 : static_cast<double>(sum) / (255.0 * static_cast<double>(cells.size()));
}

double CorrelativeMap::score(std::span<const Eigen::Vector2d> points_base, const Pose2& T_map_base) const {
  return score(rotated(points_base, T_map_base.yaw, T_map_base), {0, 0}, 0);
}

std::vector<CorrelativeMap::Offset> CorrelativeMap::rotated(std::span<const Eigen::Vector2d> points,
                                                            double yaw, const Pose2& centre) const {
  const Pose2 pose{centre.x, centre.y, yaw};
  const double c = std::cos(pose.yaw), s = std::sin(pose.yaw);
  std::vector<Offset> cells;
  cells.reserve(points.size());
  for (const Eigen::Vector2d& p : points) {
    cells.push_back({static_cast<int>(std::floor((pose.x + c * p.x() - s * p.y() - x_min_) / resolution_)),
                     static_cast<int>(std::floor((pose.y + s * p.x() + c * p.y() - y_min_) / resolution_))});
  }
  return cells;
}

/// From the middle outwards.
std::vector<double> CorrelativeMap::yaws(std::span<const Eigen::Vector2d> points,
                                         const Window& window) const {
  double far = 1;
  for (const Eigen::Vector2d& p : points) far = std::max(far, p.norm());
  // Angle step at which the farthest point moves by one cell, but at least 0.5 degrees.
  const double step = std::max(resolution_ / far, 0.0087);
  const int steps = static_cast<int>(std::ceil(window.angle / step));
  std::vector<double> yaws;
  for (int i = 0; i <= 2 * steps; ++i) {
    const int k = i % 2 == 1 ? (i + 1) / 2 : -(i / 2);
    yaws.push_back(window.centre.yaw + k * step);
  }
  return yaws;
}

std::vector<CorrelativeMap::Candidate> CorrelativeMap::search(std::span<const Eigen::Vector2d> points_base,
                                                              const Window& window,
                                                              const Request& request) const {
  WindowSearch search(*this, points_base, window, request);
  search.advance(*this, std::numeric_limits<std::size_t>::max());
  return search.found();
}

std::vector<CorrelativeMap::Candidate> CorrelativeMap::search_slow(
    std::span<const Eigen::Vector2d> points_base, const Window& window, const Request& request) const {
  WindowSearch::Places places{request, {}};
  const int reach_x = static_cast<int>(std::ceil(window.reach_x / resolution_)),
            reach_y = static_cast<int>(std::ceil(window.reach_y / resolution_));
  for (const double yaw : yaws(points_base, window)) {
    const std::vector<Offset> cells = rotated(points_base, yaw, window.centre);
    for (int y = -reach_y; y <= reach_y; ++y) {
      for (int x = -reach_x; x <= reach_x; ++x) {
        const double found = score(cells, {x, y}, 0);
        if (found > places.bound())
          places.take(
              {{window.centre.x + x * resolution_, window.centre.y + y * resolution_, wrap_angle(yaw)},
               found});
      }
    }
  }
  return places.found;
}

}  // namespace parhelion::pose
