#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "fusion/semantic/grid/cell_grid.hpp"
#include "fusion/semantic/grid/line_votes.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kStrip = 1.0;       ///< cells on either side of a line that may belong to a wall
constexpr double kFitStrip = 1.5;    ///< the same for the fit
constexpr double kMaxFreeGap = 2.0;  ///< cells of free space that a wall may bridge; doors are wider
constexpr double kMaxGap = 6.0;      ///< cells, if none of them is known to be free
constexpr int kPatch = 8;            ///< cells: side of the patches that are skipped where empty
static_assert(kPatch - kStrip > kMaxGap);
constexpr int kMaxHalfThickness = 6;  ///< cells
constexpr double kLayerWidth = 0.25;  ///< cells
constexpr int kMaxLayer = static_cast<int>(kMaxHalfThickness / kLayerWidth);

/// A piece of a line without a gap, from t = begin to end.
struct Run {
  double begin = 0, end = 0;
  double score = 0;  ///< cells of wall less cells of free space
};

class WallFinder {
 public:
  WallFinder(const CellGrid& grid, double min_length, CellMask& left)
      : grid_(grid),
        min_length_(min_length),
        left_(left),
        accumulator_(grid),
        patches_across_(grid.width / kPatch + 1),
        patches_up_(grid.height / kPatch + 1),
        patches_(static_cast<std::size_t>(patches_across_) * static_cast<std::size_t>(patches_up_)) {
    for (std::size_t i = 0; i < left_.size(); ++i) {
      if (left_[i] == 0) continue;
      accumulator_.add(grid_.centre(i), 1);
      ++patch_of(grid_.centre(i));
    }
  }

  std::vector<PlanBox> find() {
    std::vector<PlanBox> walls;
    const int min_votes = std::max(3, static_cast<int>(min_length_ * 0.7));
    while (auto line = accumulator_.peak(min_votes)) {
      const auto wall = wall_on(*line);
      if (!wall || take_cells(*wall) == 0) {
        accumulator_.bury_peak();
      } else {
        walls.push_back(*wall);
      }
    }
    return walls;
  }

 private:
  bool is_left(const Eigen::Vector2d& p) const {
    const int x = static_cast<int>(std::floor(p.x()));
    const int y = static_cast<int>(std::floor(p.y()));
    return grid_.contains(x, y) && left_[grid_.index(x, y)] != 0;
  }
  Cell cell(const Eigen::Vector2d& p) const {
    return grid_.at(static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y())));
  }

  /// Whether a cell is left in the patch around p or in a neighbouring one: at least all within `patch` cells
  /// of p.
  bool is_near_left(const Eigen::Vector2d& p) const {
    const int x = static_cast<int>(std::floor(p.x() / kPatch)),
              y = static_cast<int>(std::floor(p.y() / kPatch));
    for (int k = 0; k < 9; ++k) {
      const int i = x + k % 3 - 1, j = y + k / 3 - 1;
      if (i < 0 || j < 0 || i >= patches_across_ || j >= patches_up_) continue;
      if (patches_[patch_index(i, j)] > 0) return true;
    }
    return false;
  }
  std::size_t patch_index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(patches_across_) +
           static_cast<std::size_t>(i);
  }
  int& patch_of(const Eigen::Vector2d& p) {
    return patches_[patch_index(static_cast<int>(p.x() / kPatch), static_cast<int>(p.y() / kPatch))];
  }

  /// The best run on a line, sampled at half cells.
  Run best_run(const GridLine& line) const {
    constexpr double step = 0.5;
    const Eigen::Vector2d middle(grid_.width / 2.0, grid_.height / 2.0);
    const double t_middle = (middle - line.point).dot(line.along());
    const double reach = std::hypot(grid_.width, grid_.height) / 2 + 1;
    Run best, run;
    double gap = 0, free_in_gap = 0;
    bool open = false;
    for (double t = std::floor(t_middle - reach); t <= t_middle + reach; t += step) {
      if (!is_near_left(line.at(t, 0))) {
        // No cell within the next `patch` cells, which is more than any bridged gap.
        open = false;
        gap = free_in_gap = 0;
        t += kPatch - kStrip - step;
        continue;
      }
      const bool hit = is_left(line.at(t, 0)) || is_left(line.at(t, kStrip)) || is_left(line.at(t, -kStrip));
      if (hit) {
        if (!open) run = Run{t, t, 0};
        open = true;
        run.end = t;
        run.score += step - free_in_gap;
        gap = free_in_gap = 0;
        if (run.score > best.score) best = run;
      } else if (open) {
        const bool is_free = cell(line.at(t, 0)) == Cell::free;
        gap += step;
        free_in_gap += is_free ? step : 0;
        open = gap <= kMaxGap && free_in_gap <= kMaxFreeGap;
        if (!open) gap = free_in_gap = 0;
      }
    }
    return best;
  }

  /// Cells left within `half_width` of a run, by index, without duplicates.
  std::vector<std::size_t> cells_of(const GridLine& line, const Run& run, double half_width) const {
    std::vector<std::size_t> found;
    for (double t = run.begin; t <= run.end; t += 0.5) {
      for (double d = -half_width; d <= half_width; d += 0.5) {
        const Eigen::Vector2d p = line.at(t, d);
        if (is_left(p))
          found.push_back(
              grid_.index(static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y()))));
      }
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  /// Total least squares through the cells of a run.
  std::optional<GridLine> fit(const GridLine& line, const Run& run) const {
    const auto inliers = cells_of(line, run, kFitStrip);
    if (inliers.size() < 3) return std::nullopt;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const std::size_t i : inliers) mean += grid_.centre(i);
    mean /= static_cast<double>(inliers.size());
    double xx = 0, xy = 0, yy = 0;
    for (const std::size_t i : inliers) {
      const Eigen::Vector2d p = grid_.centre(i) - mean;
      xx += p.x() * p.x();
      xy += p.x() * p.y();
      yy += p.y() * p.y();
    }
    return GridLine{mean, 0.5 * std::atan2(2 * xy, xx - yy)};
  }

  std::optional<PlanBox> wall_on(GridLine line) const {
    Run run = best_run(line);
    for (int round = 0; round < 4 && run.score > 0; ++round) {
      const auto better = fit(line, run);
      if (!better) break;
      const Run again = best_run(*better);
      if (again.score < run.score) break;
      const bool settled = again.score == run.score;
      line = *better;
      run = again;
      if (settled) break;
    }
    if (run.score < min_length_) return std::nullopt;
    const PlanBox box = box_around(line, run);
    // A run as thick as long is a block, not a wall.
    if (box.length < min_length_ || box.length < 2 * box.thickness) return std::nullopt;
    return box;
  }

  /// Thickness: layers of a quarter cell, outwards from the line while they hold more wall than other cells.
  /// A cell left out would need a box of its own, so wall counts double; unknown space counts half as much as
  /// free space.
  PlanBox box_around(const GridLine& line, const Run& run) const {
    const auto cells = cells_of(line, run, kMaxHalfThickness + 0.5);
    std::array<double, 2 * kMaxLayer + 1> gain{};
    for (const std::size_t i : cells) {
      const auto layer =
          std::lround((grid_.centre(i) - line.point).dot(line.across()) / kLayerWidth) + kMaxLayer;
      if (layer >= 0 && layer < static_cast<long>(gain.size())) gain.at(static_cast<std::size_t>(layer)) += 2;
    }
    for (int layer = 0; layer <= 2 * kMaxLayer; ++layer) {
      for (double t = run.begin; t <= run.end; t += 1) {
        const Cell seen = cell(line.at(t, (layer - kMaxLayer) * kLayerWidth));
        const double price = seen == Cell::free ? 1 : seen == Cell::unknown ? 0.5 : 0;
        gain.at(static_cast<std::size_t>(layer)) -= price * kLayerWidth;
      }
    }
    const auto reach = [&](int direction) {
      int best = 0;
      double sum = 0, largest = 0;
      for (int k = 1; k <= kMaxLayer; ++k) {
        const int layer = kMaxLayer + direction * k;
        sum += gain.at(static_cast<std::size_t>(layer));
        if (sum > largest) {
          largest = sum;
          best = k;
        }
      }
      return (best + 0.5) * kLayerWidth;
    };
    return tight_box(line, cells, -reach(-1), reach(1));
  }

  /// Around the cells with low <= d <= high; at least one cell thick.
  PlanBox tight_box(const GridLine& line, const std::vector<std::size_t>& cells, double low,
                    double high) const {
    double t0 = 1e300, t1 = -1e300, d0 = 1e300, d1 = -1e300;
    for (const std::size_t i : cells) {
      const Eigen::Vector2d p = grid_.centre(i) - line.point;
      const double d = p.dot(line.across());
      if (d < low || d > high) continue;
      const double t = p.dot(line.along());
      t0 = std::min(t0, t);
      t1 = std::max(t1, t);
      d0 = std::min(d0, d);
      d1 = std::max(d1, d);
    }
    if (t0 > t1) return {};
    PlanBox box;
    box.yaw = line.yaw;
    box.centre = line.at((t0 + t1) / 2, (d0 + d1) / 2);
    box.length = t1 - t0 + 1;
    box.thickness = std::max(1.0, d1 - d0 + 0.1);
    return rounded(box);
  }

  /// Rounds angles and lengths for a readable file; the box never shrinks.
  static PlanBox rounded(PlanBox box) {
    constexpr double degree = std::numbers::pi / 180;
    constexpr double grain = 0.02;  // cells: 1 mm of 5 cm
    box.yaw = std::round(box.yaw / degree * 1e3) / 1e3 * std::numbers::pi / 180;
    box.length = (std::ceil(box.length / grain - 1e-9) + 1) * grain;
    box.thickness = std::ceil(box.thickness / grain - 1e-9) * grain;
    return box;
  }

  /// Number of cells that the box covered.
  int take_cells(const PlanBox& box) {
    const double reach = std::hypot(box.length, box.thickness) / 2 + 1;
    int taken = 0;
    const auto low = [reach](double c) { return std::max(0, static_cast<int>(std::floor(c - reach))); };
    const auto high = [reach](double c, int n) {
      return std::min(n - 1, static_cast<int>(std::ceil(c + reach)));
    };
    for (int y = low(box.centre.y()); y <= high(box.centre.y(), grid_.height); ++y) {
      for (int x = low(box.centre.x()); x <= high(box.centre.x(), grid_.width); ++x) {
        const std::size_t i = grid_.index(x, y);
        if (left_[i] == 0 || !box.covers(grid_.centre(i))) continue;
        left_[i] = 0;
        accumulator_.add(grid_.centre(i), -1);
        --patch_of(grid_.centre(i));
        ++taken;
      }
    }
    return taken;
  }

  const CellGrid& grid_;
  double min_length_;
  CellMask& left_;
  LineVotes accumulator_;
  int patches_across_, patches_up_;
  std::vector<int> patches_;  ///< cells left in each patch
};

}  // namespace

std::vector<PlanBox> find_walls(const CellGrid& grid, double min_length, CellMask& left) {
  return WallFinder(grid, min_length, left).find();
}

}  // namespace parhelion::semantic
