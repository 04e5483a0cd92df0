#include "fusion/pose/matching/correlative.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace parhelion::pose {
namespace {

constexpr double kKernelCells = 3;  ///< radius of a point's likelihood

/// grid(x) = max over grid(x .. x + step) along one axis, where grid already is the maximum over `step`
/// cells.
void widen(std::vector<std::uint8_t>& grid, int width, int height, int step, bool along_x) {
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int ox = along_x ? x + step : x, oy = along_x ? y : y + step;
      if (ox >= width || oy >= height) continue;
      auto& own =
          grid[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
      own = std::max(own, grid[static_cast<std::size_t>(oy) * static_cast<std::size_t>(width) +
                               static_cast<std::size_t>(ox)]);
    }
  }
}

}  // namespace

struct CorrelativeMap::Search {
  const Window& window;
  const Request& request;
  int reach_x, reach_y;  ///< cells
  double points;
  std::vector<Candidate> found;

  double bound() const {
    return found.size() < request.count ? request.min_score : std::max(request.min_score, found.back().score);
  }
  void take(const Candidate& candidate) {
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
};

CorrelativeMap::CorrelativeMap(std::span<const Eigen::Vector2d> points_map, double resolution, int levels,
                               double sigma_cells)
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
          std::lround(255 * std::exp(-0.5 * (i * i + j * j) / (sigma_cells * sigma_cells))));
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
  grids_.push_back(grid);
  for (int h = 1; h < levels_; ++h) {
    widen(grid, width_, height_, 1 << (h - 1), true);
    widen(grid, width_, height_, 1 << (h - 1), false);
    grids_.push_back(grid);
  }
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

void CorrelativeMap::branch(Search& search, const std::vector<Offset>& cells, double yaw, Offset shift,
                            int level) const {
  if (level == 0) {
    search.take({{search.window.centre.x + shift.x * resolution_,
                  search.window.centre.y + shift.y * resolution_, yaw},
                 score(cells, shift, 0)});
    return;
  }
  struct Child {
    Offset shift;
    double score;
  };
  std::array<Child, 4> children;
  const int half = 1 << (level - 1);
  std::size_t count = 0;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const Offset child{shift.x + i * half, shift.y + j * half};
      if (child.x > search.reach_x || child.y > search.reach_y) continue;
      children[count++] = {child, score(cells, child, level - 1)};
    }
  }
  std::stable_sort(children.begin(), children.begin() + static_cast<std::ptrdiff_t>(count),
                   [](const Child& a, const Child& b) { return a.score > b.score; });
  for (std::size_t i = 0; i < count; ++i) {
    if (children[i].score <= search.bound()) break;
    branch(search, cells, yaw, children[i].shift, level - 1);
  }
}

template <class Visit>
void CorrelativeMap::each_yaw(std::span<const Eigen::Vector2d> points, const Window& window,
                              Visit visit) const {
  double far = 1;
  for (const Eigen::Vector2d& p : points) far = std::max(far, p.norm());
  // Angle step at which the farthest point moves by one cell, but at least 0.5 degrees.
  const double step = std::max(resolution_ / far, 0.0087);
  const int steps = static_cast<int>(std::ceil(window.angle / step));
  for (int i = 0; i <= 2 * steps; ++i) {
    const int k = i % 2 == 1 ? (i + 1) / 2 : -(i / 2);  // from the middle outwards
    const double yaw = window.centre.yaw + k * step;
    visit(wrap_angle(yaw), rotated(points, yaw, window.centre));
  }
}

std::vector<CorrelativeMap::Candidate> CorrelativeMap::search(std::span<const Eigen::Vector2d> points_base,
                                                              const Window& window,
                                                              const Request& request) const {
  Search search{window,
                request,
                static_cast<int>(std::ceil(window.reach_x / resolution_)),
                static_cast<int>(std::ceil(window.reach_y / resolution_)),
                static_cast<double>(points_base.size()),
                {}};
  int top = 0;
  while (top + 1 < levels_ && (1 << top) < 2 * std::min(search.reach_x, search.reach_y)) ++top;
  struct Root {
    std::size_t yaw;
    Offset shift;
    double score;
  };
  std::vector<Root> roots;
  std::vector<std::pair<double, std::vector<Offset>>> turned;
  each_yaw(points_base, window, [&](double yaw, std::vector<Offset> cells) {
    for (int y = -search.reach_y; y <= search.reach_y; y += 1 << top) {
      for (int x = -search.reach_x; x <= search.reach_x; x += 1 << top) {
        const double bound = score(cells, {x, y}, top);
        if (bound > request.min_score) roots.push_back({turned.size(), {x, y}, bound});
      }
    }
    turned.emplace_back(yaw, std::move(cells));
  });
  std::stable_sort(roots.begin(), roots.end(),
                   [](const Root& a, const Root& b) { return a.score > b.score; });
  for (const Root& root : roots) {
    if (root.score <= search.bound()) break;
    branch(search, turned[root.yaw].second, turned[root.yaw].first, root.shift, top);
  }
  return search.found;
}

std::vector<CorrelativeMap::Candidate> CorrelativeMap::search_slow(
    std::span<const Eigen::Vector2d> points_base, const Window& window, const Request& request) const {
  Search search{window,
                request,
                static_cast<int>(std::ceil(window.reach_x / resolution_)),
                static_cast<int>(std::ceil(window.reach_y / resolution_)),
                static_cast<double>(points_base.size()),
                {}};
  each_yaw(points_base, window, [&](double yaw, const std::vector<Offset>& cells) {
    for (int y = -search.reach_y; y <= search.reach_y; ++y) {
      for (int x = -search.reach_x; x <= search.reach_x; ++x) {
        if (score(cells, {x, y}, 0) > search.bound()) branch(search, cells, yaw, {x, y}, 0);
      }
    }
  });
  return search.found;
}

}  // namespace parhelion::pose
