#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "fusion/semantic/grid/cell_grid.hpp"

namespace parhelion::semantic {
namespace {

constexpr long kBoxPrice = 2;  ///< minimum number of saved non-solid cells that justifies one more box

struct Rectangle {
  int x0 = 0, y0 = 0, x1 = -1, y1 = -1;  ///< cells, inclusive
  bool empty() const { return x1 < x0; }
};

/// Sums over rectangles of cells in constant time.
class SummedArea {
 public:
  template <class Counts>
  SummedArea(const CellGrid& grid, Counts counts)
      : width_(grid.width + 1),
        sums_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(grid.height + 1)) {
    for (int y = 0; y < grid.height; ++y) {
      for (int x = 0; x < grid.width; ++x) {
        sums_[at(x + 1, y + 1)] =
            sums_[at(x, y + 1)] + sums_[at(x + 1, y)] - sums_[at(x, y)] + (counts(grid.index(x, y)) ? 1 : 0);
      }
    }
  }
  long sum(const Rectangle& r) const {
    return sums_[at(r.x1 + 1, r.y1 + 1)] - sums_[at(r.x0, r.y1 + 1)] - sums_[at(r.x1 + 1, r.y0)] +
           sums_[at(r.x0, r.y0)];
  }

 private:
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  int width_;
  std::vector<long> sums_;
};

/// Splits the plane recursively where that saves the largest number of non-solid cells.
class BlockCover {
 public:
  BlockCover(const CellGrid& grid, const CellMask& mask, const CoverLimits& limits)
      : grid_(grid),
        limits_(limits),
        wanted_(grid, [&](std::size_t i) { return mask[i] != 0; }),
        open_(grid, [&](std::size_t i) { return grid.cells[i] != Cell::occupied; }),
        free_(grid, [&](std::size_t i) { return grid.cells[i] == Cell::free; }) {}

  std::vector<PlanBox> cover() {
    std::vector<PlanBox> boxes;
    std::vector<Rectangle> open{tight({0, 0, grid_.width - 1, grid_.height - 1})};
    while (!open.empty()) {
      const Rectangle r = open.back();
      open.pop_back();
      if (r.empty()) continue;
      const long wasted = open_.sum(r);
      const Cut cut = wasted > 0 ? best_cut(r) : Cut{};
      const bool pays = cut.price + kBoxPrice < wasted;
      const bool hollow = 2 * wasted > wanted_.sum(r);
      const bool holed = wasted > limits_.not_solid || free_.sum(r) > limits_.free;
      if (cut.found && (pays || hollow || holed)) {
        open.push_back(cut.second);
        open.push_back(cut.first);
      } else {
        boxes.push_back(box(r));
      }
    }
    return boxes;
  }

 private:
  struct Cut {
    bool found = false;
    Rectangle first, second;
    long price = std::numeric_limits<long>::max() / 2;
  };

  /// The smallest rectangle with the same wanted cells.
  Rectangle tight(Rectangle r) const {
    if (r.empty() || wanted_.sum(r) == 0) return {};
    // The nearest bound at which cells are lost, by bisection.
    const auto shrink = [&](auto lose, int low, int high) {
      while (low < high) {
        const int middle = low + (high - low + 1) / 2;
        if (wanted_.sum(lose(middle)) == wanted_.sum(r)) {
          low = middle;
        } else {
          high = middle - 1;
        }
      }
      return low;
    };
    r.x0 = shrink([&](int v) { return Rectangle{v, r.y0, r.x1, r.y1}; }, r.x0, r.x1);
    r.y0 = shrink([&](int v) { return Rectangle{r.x0, v, r.x1, r.y1}; }, r.y0, r.y1);
    r.x1 = -shrink([&](int v) { return Rectangle{r.x0, r.y0, -v, r.y1}; }, -r.x1, -r.x0);
    r.y1 = -shrink([&](int v) { return Rectangle{r.x0, r.y0, r.x1, -v}; }, -r.y1, -r.y0);
    return r;
  }

  /// Minimises the non-solid cells in the two halves; if equal, prefers the wider gap between them, then the
  /// larger half without such cells, so that cuts follow the sides of a hole.
  Cut best_cut(const Rectangle& r) const {
    Cut best;
    long best_gap = -1, best_clean = -1;
    const auto clean = [&](const Rectangle& half) { return open_.sum(half) == 0 ? wanted_.sum(half) : 0; };
    const auto consider = [&](const Rectangle& a, const Rectangle& b) {
      const Rectangle first = tight(a), second = tight(b);
      if (first.empty() || second.empty()) return;
      const long price = open_.sum(first) + open_.sum(second);
      const long gap = std::max(second.x0 - first.x1, second.y0 - first.y1);
      if (price > best.price || (price == best.price && gap < best_gap)) return;
      const long clean_cells = std::max(clean(first), clean(second));
      if (price == best.price && gap == best_gap && clean_cells <= best_clean) return;
      best = {true, first, second, price};
      best_gap = gap;
      best_clean = clean_cells;
    };
    for (int x = r.x0; x < r.x1; ++x) consider({r.x0, r.y0, x, r.y1}, {x + 1, r.y0, r.x1, r.y1});
    for (int y = r.y0; y < r.y1; ++y) consider({r.x0, r.y0, r.x1, y}, {r.x0, y + 1, r.x1, r.y1});
    return best;
  }

  static PlanBox box(const Rectangle& r) {
    PlanBox out;
    out.centre = {(r.x0 + r.x1 + 1) / 2.0, (r.y0 + r.y1 + 1) / 2.0};
    out.length = r.x1 - r.x0 + 1;
    out.thickness = r.y1 - r.y0 + 1;
    return out;
  }

  const CellGrid& grid_;
  const CoverLimits& limits_;
  SummedArea wanted_;
  SummedArea open_;  ///< cells that are not known to be solid
  SummedArea free_;
};

}  // namespace

std::vector<PlanBox> cover_with_blocks(const CellGrid& grid, const CellMask& mask,
                                       const CoverLimits& limits) {
  return BlockCover(grid, mask, limits).cover();
}

CellMask solid_areas(const CellGrid& grid, const CellMask& mask, int side) {
  const SummedArea wanted(grid, [&](std::size_t i) { return mask[i] != 0; });
  CellMask solid(mask.size(), 0);
  for (int y = 0; y + side <= grid.height; ++y) {
    for (int x = 0; x + side <= grid.width; ++x) {
      if (wanted.sum({x, y, x + side - 1, y + side - 1}) < static_cast<long>(side) * side) continue;
      for (int k = 0; k < side * side; ++k) solid[grid.index(x + k % side, y + k / side)] = 1;
    }
  }
  return solid;
}

CellMask supported_or_in_reach(const CellGrid& grid, const CellMask& mask, int min_support,
                               double clear_radius, double reach) {
  // Squares, so that sums suffice: a smaller one than the robot and a larger one than its reach, never the
  // reverse.
  const auto around = [&](std::size_t i, int side) {
    const auto w = static_cast<std::size_t>(grid.width);
    const int x = static_cast<int>(i % w), y = static_cast<int>(i / w);
    return Rectangle{std::max(x - side, 0), std::max(y - side, 0), std::min(x + side, grid.width - 1),
                     std::min(y + side, grid.height - 1)};
  };
  const int clear = static_cast<int>(std::floor(clear_radius / std::numbers::sqrt2));
  const int near = static_cast<int>(std::ceil(reach));
  const SummedArea not_free(grid, [&](std::size_t i) { return grid.cells[i] != Cell::free; });
  const SummedArea standable(grid, [&](std::size_t i) { return not_free.sum(around(i, clear)) == 0; });

  CellMask kept(mask.size(), 0), seen(mask.size(), 0);
  std::vector<std::size_t> group;
  for (std::size_t first = 0; first < mask.size(); ++first) {
    if (mask[first] == 0 || seen[first] != 0) continue;
    group.assign(1, first);
    seen[first] = 1;
    bool in_reach = false;
    for (std::size_t k = 0; k < group.size(); ++k) {
      in_reach = in_reach || standable.sum(around(group[k], near)) > 0;
      const Rectangle r = around(group[k], 1);
      for (int y = r.y0; y <= r.y1; ++y) {
        for (int x = r.x0; x <= r.x1; ++x) {
          const std::size_t next = grid.index(x, y);
          if (mask[next] == 0 || seen[next] != 0) continue;
          seen[next] = 1;
          group.push_back(next);
        }
      }
    }
    if (!in_reach && group.size() < static_cast<std::size_t>(min_support)) continue;
    for (const std::size_t cell : group) kept[cell] = 1;
  }
  return kept;
}

}  // namespace parhelion::semantic
