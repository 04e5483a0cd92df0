// A grid map classified into three kinds of cells, and boxes seen from above. Internal to this module.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace parhelion::semantic {

enum class Cell : std::uint8_t { free, unknown, occupied };

struct CellGrid {
  int width = 0, height = 0;                         ///< cells; row 0 at the lowest y
  double resolution = 0.05;                          ///< m
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< m, corner of cell (0, 0)
  std::vector<Cell> cells;

  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
  /// Cells outside of the map are unknown.
  Cell at(int x, int y) const { return contains(x, y) ? cells[index(x, y)] : Cell::unknown; }
  /// In cells, from the origin.
  Eigen::Vector2d centre(std::size_t i) const {
    const auto w = static_cast<std::size_t>(width);
    const std::size_t x = i % w, y = i / w;
    return {static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5};
  }
};

/// A rectangle in the grid's plane, in cells from its origin.
struct PlanBox {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double yaw = 0;  ///< rad, of the long side
  double length = 0, thickness = 0;

  bool covers(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d along(std::cos(yaw), std::sin(yaw));
    const Eigen::Vector2d offset = p - centre;
    return std::abs(offset.dot(along)) <= length / 2 &&
           std::abs(along.x() * offset.y() - along.y() * offset.x()) <= thickness / 2;
  }
};

/// 1 for each occupied cell that no box covers yet.
using CellMask = std::vector<std::uint8_t>;

/// Straight walls of at least `min_length` cells, longest support first; the cells that they cover are
/// removed from `left`.
std::vector<PlanBox> find_walls(const CellGrid& grid, double min_length, CellMask& left);

/// Limits on the cells of one rectangle of a cover; beyond them it is split even where that gains little at
/// once: a hole in its middle takes four cuts.
struct CoverLimits {
  long not_solid = std::numeric_limits<long>::max();  ///< free or unknown
  long free = std::numeric_limits<long>::max();
};

/// A small number of upright, disjoint rectangles over the cells of `mask` that contain few other cells.
std::vector<PlanBox> cover_with_blocks(const CellGrid& grid, const CellMask& mask,
                                       const CoverLimits& limits = {});

/// The groups of touching cells of `mask` (8 neighbours) that have at least `min_support` cells, or a cell
/// within `reach` cells (along x and along y) of a position where a robot may be: one where the square in the
/// disc of `clear_radius` cells around it is known to be free.
CellMask supported_or_in_reach(const CellGrid& grid, const CellMask& mask, int min_support,
                               double clear_radius, double reach);

/// The cells of `mask` that lie in some solid square of `side` cells (morphological opening).
CellMask solid_areas(const CellGrid& grid, const CellMask& mask, int side);

}  // namespace parhelion::semantic
