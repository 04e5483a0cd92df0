// Horizontal surfaces: lines in the tiles' OXZ and OYZ pictures propose heights; in each cell of the plan the
// points confirm or reject them; touching cells at one height form a surface.
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_sort.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "fusion/semantic/segmentation/block_heights.hpp"
#include "fusion/semantic/segmentation/join_plates.hpp"
#include "fusion/semantic/segmentation/side_pictures.hpp"
#include "fusion/semantic/segmentation/surface_search.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kMinArea = 0.15;  // m^2; a tread of 0.2 m x 0.8 m
// Points within over points around: of a wall's slice 0.1 m / 0.5 m, and half as much again by selecting its
// fuller cells; of a tread with its risers about 1.
constexpr double kMinFlatness = 0.4;

/// Merges heights that differ by less than two pixels.
std::vector<double> merged(std::vector<double> heights, double pixel) {
  std::sort(heights.begin(), heights.end());
  std::vector<double> result;
  for (std::size_t i = 0; i < heights.size();) {
    double sum = 0;
    std::size_t end = i;
    while (end < heights.size() && heights[end] - heights[i] < 2 * pixel) sum += heights[end++];
    result.push_back(sum / static_cast<double>(end - i));
    i = end;
  }
  return result;
}

/// Two proposals that converged to the same surface: keeps the plate with more points.
void drop_doubles(std::vector<Plate>& plates, double apart) {
  std::sort(plates.begin(), plates.end(), by_place);
  std::size_t kept = 0;
  for (const Plate& plate : plates) {
    if (kept > 0) {
      Plate& last = plates[kept - 1];
      if (last.x == plate.x && last.y == plate.y && static_cast<double>(plate.z - last.z) < apart) {
        if (plate.points > last.points) last = plate;
        continue;
      }
    }
    plates[kept++] = plate;
  }
  plates.resize(kept);
}

std::vector<Plate> plates_of_tile(const Site& site, Tile tile, StageImages* stages) {
  const LevelLines lines = level_lines(site, tile, stages);
  std::vector<Plate> plates;
  const int bx = tile.x * kTileBlocks, by = tile.y * kTileBlocks;
  site.blocks.for_each_in(
      bx, by, bx + kTileBlocks - 1, by + kTileBlocks - 1, [&](const PlanBlocks::Block& block, std::size_t) {
        std::vector<double> heights = lines.along_x[static_cast<std::size_t>(block.x - bx + 1)];
        const auto& more = lines.along_y[static_cast<std::size_t>(block.y - by + 1)];
        heights.insert(heights.end(), more.begin(), more.end());
        BlockHeights points(site, block);
        for (const double height : merged(std::move(heights), site.options.pixel))
          points.add_plates(height, plates);
      });
  drop_doubles(plates, site.options.near);
  return plates;
}

/// Whether it is seen from below. Without viewpoints and normals: a ceiling is high above the lowest wide
/// surface, and the points of its columns are below. `sums` per surface.
void find_facing(std::vector<HorizontalSurface>& surfaces, const std::vector<Plate>& sums) {
  double widest = 0, lowest = 1e30;
  for (const HorizontalSurface& s : surfaces) widest = std::max(widest, s.area);
  for (const HorizontalSurface& s : surfaces) {
    if (s.area >= 0.1 * widest) lowest = std::min(lowest, s.z);
  }
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Plate& sum = sums[i];
    surfaces[i].faces_down = sum.from_above + sum.from_below > 0
                                 ? sum.from_below > sum.from_above
                                 : surfaces[i].z > lowest + 1.8 && sum.column_below > 5 * sum.column_above;
  }
}

/// Without viewpoints, two wide surfaces close over each other are a ceiling and the floor on it.
void find_slabs(std::vector<HorizontalSurface>& surfaces, const std::vector<Plate>& sums) {
  constexpr double kThinnest = 0.06, kThickest = 0.7, kOver = 1.8;  // m
  constexpr double kWide = 3;                                       // m^2
  double lowest = 1e30;
  for (const HorizontalSurface& s : surfaces) lowest = s.area > kWide ? std::min(lowest, s.z) : lowest;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    for (std::size_t k = 0; k < surfaces.size(); ++k) {
      HorizontalSurface &under = surfaces[i], &over = surfaces[k];
      if (sums[i].from_above + sums[i].from_below + sums[k].from_above + sums[k].from_below > 0) continue;
      if (over.z - under.z < kThinnest || over.z - under.z > kThickest || under.z < lowest + kOver) continue;
      const Eigen::Vector2d both =
          (under.high.cwiseMin(over.high) - under.low.cwiseMax(over.low)).cwiseMax(0);
      const double smaller = std::min(under.area, over.area);
      if (smaller < kWide || both.prod() < 0.5 * smaller) continue;
      under.faces_down = true;
      over.faces_down = false;
    }
  }
}

/// Median of the heights within 3 cm of the median, so that a sagging edge or an object does not move a
/// surface. Heights ascending, each with its number of points.
double trimmed_median(const std::vector<std::pair<float, std::uint32_t>>& heights) {
  constexpr float keep = 0.03F;  // m
  float median = 0;
  for (int round = 0; round < 6; ++round) {
    std::uint64_t total = 0, passed = 0;
    const auto counts = [&](float z) { return round == 0 || std::abs(z - median) <= keep; };
    for (const auto& [z, points] : heights) total += counts(z) ? points : 0;
    float next = median;
    for (const auto& [z, points] : heights) {
      if (!counts(z)) continue;
      passed += points;
      next = z;
      if (2 * passed >= total) break;
    }
    if (round > 0 && next == median) break;
    median = next;
  }
  return static_cast<double>(median);
}

/// m per metre, of the plane through these plates; 0 where they lie in a row.
double slope_of(const std::vector<Plate>& plates, std::span<const std::uint32_t> members, double cell) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const auto at = [&](std::uint32_t m) {
    return Eigen::Vector3d(plates[m].x * cell, plates[m].y * cell, static_cast<double>(plates[m].z));
  };
  for (const std::uint32_t m : members) mean += at(m) / static_cast<double>(members.size());
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  Eigen::Vector2d with_height = Eigen::Vector2d::Zero();
  for (const std::uint32_t m : members) {
    const Eigen::Vector3d d = at(m) - mean;
    squares += d.head<2>() * d.head<2>().transpose();
    with_height += d.head<2>() * d.z();
  }
  const double one_row = 0.1 * cell * cell * static_cast<double>(members.size());
  if (squares.diagonal().minCoeff() < one_row ||
      squares.determinant() < 1e-3 * squares(0, 0) * squares(1, 1)) {
    return 0;
  }
  return (squares.inverse() * with_height).norm();
}

/// One surface from the plates [begin, end) of `members`; none where they are a slice of something else.
bool make_surface(const Site& site, const std::vector<Plate>& plates, std::span<const std::uint32_t> members,
                  HorizontalSurface& surface, Plate& sums) {
  const double cell = site.cell();
  surface.area = static_cast<double>(members.size()) * cell * cell;
  if (surface.area < kMinArea) return false;
  std::vector<std::pair<float, std::uint32_t>> heights;
  double variance = 0;
  std::uint64_t points = 0;
  surface.low.setConstant(1e30);
  surface.high.setConstant(-1e30);
  for (const std::uint32_t m : members) {
    const Plate& plate = plates[m];
    heights.emplace_back(plate.z, plate.points);
    points += plate.points;
    sums.around += plate.around;
    sums.from_above += plate.from_above;
    sums.from_below += plate.from_below;
    sums.column_above += plate.column_above;
    sums.column_below += plate.column_below;
    variance += static_cast<double>(plate.variance) * plate.points;
    surface.low = surface.low.cwiseMin(Eigen::Vector2d(plate.x, plate.y) * cell);
    surface.high = surface.high.cwiseMax(Eigen::Vector2d(plate.x + 1, plate.y + 1) * cell);
  }
  if (static_cast<double>(points) < kMinFlatness * sums.around) return false;
  std::sort(heights.begin(), heights.end());
  surface.z = trimmed_median(heights);
  surface.points = static_cast<std::uint32_t>(points);
  surface.thickness = 2 * std::sqrt(variance / static_cast<double>(points));
  surface.slope = slope_of(plates, members, cell);
  return true;
}

/// Plates by block, with their range per block.
void index_by_block(const Site& site, HorizontalSearch& search) {
  static_assert(std::has_single_bit(unsigned{kBlockCells}));
  const auto block_of = [](std::int32_t cell) { return cell >> std::countr_zero(unsigned{kBlockCells}); };
  tbb::parallel_sort(search.plates.begin(), search.plates.end(), [&](const Plate& a, const Plate& b) {
    const std::pair one(block_of(a.y), block_of(a.x)), other(block_of(b.y), block_of(b.x));
    return one != other ? one < other : by_place(a, b);
  });
  std::uint32_t at = 0;
  for (const PlanBlocks::Block& block : site.blocks.blocks()) {
    search.first.push_back(at);
    while (at < search.plates.size() && block_of(search.plates[at].y) == block.y &&
           block_of(search.plates[at].x) == block.x)
      ++at;
  }
  search.first.push_back(at);
}

}  // namespace

HorizontalSearch find_horizontals(const Site& site, StageImages* stages) {
  std::vector<std::vector<Plate>> of_tiles(site.tiles.size());
  if (stages != nullptr) {
    for (std::size_t t = 0; t < of_tiles.size(); ++t)
      of_tiles[t] = plates_of_tile(site, site.tiles[t], stages);
  } else {
    tbb::parallel_for(std::size_t{0}, of_tiles.size(),
                      [&](std::size_t t) { of_tiles[t] = plates_of_tile(site, site.tiles[t], nullptr); });
  }
  std::vector<Plate> plates;
  for (const auto& of_tile : of_tiles) plates.insert(plates.end(), of_tile.begin(), of_tile.end());
  of_tiles.clear();
  tbb::parallel_sort(plates.begin(), plates.end(), by_place);  // no two are equal

  const std::vector<std::uint32_t> part = join_plates(plates, site.cell());
  std::vector<std::uint32_t> next(plates.size() + 1, 0), by_part(plates.size());
  for (const std::uint32_t p : part) ++next[p + 1U];
  std::partial_sum(next.begin(), next.end(), next.begin());
  for (std::uint32_t i = 0; i < plates.size(); ++i) by_part[next[part[i]]++] = i;
  HorizontalSearch search;
  std::vector<Plate> sums;
  for (std::size_t i = 0; i < by_part.size();) {
    std::size_t end = i;
    while (end < by_part.size() && part[by_part[end]] == part[by_part[i]]) ++end;
    const auto members = std::span(by_part).subspan(i, end - i);
    HorizontalSurface surface;
    Plate sum;
    if (make_surface(site, plates, members, surface, sum)) {
      for (const std::uint32_t m : members) {
        plates[m].surface = static_cast<std::uint32_t>(search.surfaces.size());
        search.plates.push_back(plates[m]);
      }
      search.surfaces.push_back(surface);
      sums.push_back(sum);
    }
    i = end;
  }
  find_facing(search.surfaces, sums);
  find_slabs(search.surfaces, sums);
  index_by_block(site, search);
  return search;
}

}  // namespace parhelion::semantic
