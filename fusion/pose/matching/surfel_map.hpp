// A map of scan points as small pieces of surface: per cell the moments of its points, and from those of the
// cell and its neighbours a mean and a normal (a normal distributions map, Biber and Strasser 2003, matched
// point to line). Averaging makes it more accurate than its cell size; moments can be subtracted again, so
// the map can follow the robot.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "protocols/pose2.hpp"

namespace parhelion::pose {

struct Surfel {
  Eigen::Vector2d mean;        ///< m, map frame
  Eigen::Vector2d normal;      ///< unit; undefined where neither flat nor thick
  Eigen::Matrix2d covariance;  ///< m^2, of the points about the mean; larger where they are few
  double thickness = 0;        ///< m, 1 sigma along the normal
  float points = 0;            ///< number of points that it was made from
  bool flat = false;
  /// Not flat, but its points reach across the cells: a surface that the laser's noise makes thick, and no
  /// thing of its own size.
  bool thick = false;
};

/// The column or row of a coordinate: rounded down. std::floor() is a call of the library where the
/// processor's baseline has no instruction for it.
inline std::int64_t cell_of(double v, double cell) {
  const double cells = v / cell;
  const auto truncated = static_cast<std::int64_t>(cells);
  return truncated - (static_cast<double>(truncated) > cells ? 1 : 0);
}

/// m^2, along a surface that runs evenly through the three cells that a surfel is made from.
double through_variance(double cell);

class SurfelMap {
 public:
  explicit SurfelMap(double cell);  ///< m, side of a cell

  double cell() const { return cell_; }
  /// Squares of cells that it has made so far: memory, and the time to clear it.
  std::size_t tiles() const { return made_; }
  /// weight 1 adds the points, -1 removes points that were added from the same pose.
  void add(std::span<const Eigen::Vector2d> points_base, const Pose2& T_map_base, double weight = 1);
  /// The surfel that explains p best: that of its own cell, or the nearest of the neighbouring cells; nullptr
  /// where there is none.
  const Surfel* nearest(const Eigen::Vector2d& p_map) const;
  /// The same by checking every cell; for tests.
  const Surfel* nearest_slow(const Eigen::Vector2d& p_map) const;

  /// What a cell is made from: its column and row from the map's origin, and the number and moments (m, m^2)
  /// of its points about its centre.
  struct Moments {
    std::int32_t column = 0, row = 0;
    double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  };
  /// Of the cells that have points, tile by tile.
  std::vector<Moments> moments() const;
  void add(const Moments& moments);
  /// Computes all surfels, so that nearest() only reads: for a map that changes no more.
  void finish();

 private:
  static constexpr int kTileBits = 4, kTileCells = 1 << kTileBits;  ///< along each side of a tile
  static constexpr std::int64_t kInTile = kTileCells - 1;           ///< mask of a cell's number in its tile
  struct Cell {
    double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;  ///< moments about the cell's centre
    Surfel surfel;
    bool stale = true, valid = false;
  };
  struct Tile {
    std::vector<Cell> cells = std::vector<Cell>(std::size_t{kTileCells} * kTileCells);
  };

  /// As those of most cells are.
  static bool has_neighbours_in_tile(std::int64_t cx, std::int64_t cy) {
    const std::int64_t x = cx & kInTile, y = cy & kInTile;
    return x > 0 && x < kInTile && y > 0 && y < kInTile;
  }
  Cell* find(std::int64_t cx, std::int64_t cy) const;
  Cell& make(std::int64_t cx, std::int64_t cy);
  void grow(std::int64_t tx, std::int64_t ty);
  /// nullptr: it has no points.
  const Surfel* surfel(Cell& cell, std::int64_t cx, std::int64_t cy) const;
  void mark_stale(Cell& cell, std::int64_t cx, std::int64_t cy);
  template <class Visit>
  void for_each_cell(Visit visit) const;
  void refresh(Cell& cell, std::int64_t cx, std::int64_t cy) const;

  double cell_;
  std::int64_t tx0_ = 0, ty0_ = 0, tiles_x_ = 0, tiles_y_ = 0;  ///< the directory of tiles
  std::vector<std::unique_ptr<Tile>> tiles_;
  std::size_t made_ = 0;  ///< of them
};

}  // namespace parhelion::pose
