#include "fusion/semantic/net/hanging_wall.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::semantic {

bool hangs(const PlanPoints& points, const WallCandidate& wall) {
  constexpr double kFrom = 0.03, kTo = 0.15, kLevel = 0.05;  // m beside its plane; m from the floor
  constexpr double kUnder = 0.6, kFewer = 0.25;              // of its columns; of the fullest band's cells
  constexpr int kFoot = 1, kBand = 2;                        // rows: the lowest holds the floor
  const WallRaster& raster = wall.raster;
  const auto measured = [&](int first) {
    int cells = 0;
    for (int r = first; r < first + kBand; ++r) {
      for (int c = 0; c < raster.columns; ++c) cells += raster.measured[raster.at(c, r)] > 0 ? 1 : 0;
    }
    return cells;
  };
  int fullest = 0;
  for (int r = kFoot; r + kBand <= raster.rows; ++r) fullest = std::max(fullest, measured(r));
  if (raster.rows < kFoot + kBand || measured(kFoot) > kFewer * fullest) return false;
  const auto columns = static_cast<std::size_t>(raster.columns);
  std::vector<bool> before(columns), behind(columns);
  points.near_segment(wall.start, wall.end, kTo, [&](const PlanPoints::Point& point) {
    if (std::abs(static_cast<double>(point.p.z()) - wall.floor) > kLevel) return;
    const Eigen::Vector2d d = point.p.head<2>().cast<double>() - wall.start;
    const double offset = raster.away.dot(d), at = raster.along.dot(d) / raster.column;
    if (at < 0 || at >= raster.columns || std::abs(offset) < kFrom || std::abs(offset) > kTo) return;
    (offset > 0 ? behind : before)[static_cast<std::size_t>(at)] = true;
  });
  const auto is_covered = [&](const std::vector<bool>& side) {
    return static_cast<double>(std::count(side.begin(), side.end(), true)) > kUnder * raster.columns;
  };
  return is_covered(before) && is_covered(behind);
}

}  // namespace parhelion::semantic
