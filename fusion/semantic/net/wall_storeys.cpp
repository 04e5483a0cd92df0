#include "fusion/semantic/net/wall_storeys.hpp"

#include <algorithm>

namespace parhelion::semantic {
namespace {

constexpr double kStorey = 2.2;  ///< m, between two floors along a wall, and from the last one to the ceiling
constexpr double kWide = 4;      ///< m^2, of a floor
constexpr double kAlong = 0.3;   ///< of the wall's length, that the floor extends along
constexpr double kBeside = 0.6;  ///< m
constexpr double kSlab = 0.7;    ///< m, from a ceiling to the floor on it

/// Fraction of the wall's length beside a surface's bounds.
double along_fraction(const WallCandidate& wall, const HorizontalSurface& surface) {
  constexpr int kSamples = 40;
  const Eigen::AlignedBox2d plan((surface.low.array() - kBeside).matrix(),
                                 (surface.high.array() + kBeside).matrix());
  int inside = 0;
  for (int k = 0; k < kSamples; ++k) {
    const Eigen::Vector2d p = wall.start + (k + 0.5) / kSamples * (wall.end - wall.start);
    inside += plan.contains(p) ? 1 : 0;
  }
  return static_cast<double>(inside) / kSamples;
}

/// m, of the floors over the wall's own, ascending: those along most of it first, none close to another. A
/// landing half way up is beside a smaller part of a wall than the storeys' floors.
std::vector<double> upper_floors(const Segmentation& segmentation, const Levels& levels,
                                 const WallCandidate& wall) {
  std::vector<std::pair<double, double>> floors;  // length along the wall, height
  for (std::size_t h = 0; h < segmentation.horizontals.size(); ++h) {
    const HorizontalSurface& surface = segmentation.horizontals[h];
    if (surface.area < kWide || surface.z < wall.floor + kStorey || surface.z > wall.z_high - kStorey ||
        levels.floor_score(h) <= 0)
      continue;
    const double along = along_fraction(wall, surface);
    if (along > kAlong) floors.emplace_back(along, surface.z);
  }
  std::sort(floors.begin(), floors.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  std::vector<double> found;
  for (const auto& [along, z] : floors) {
    const bool apart = std::none_of(found.begin(), found.end(),
                                    [z = z](double other) { return std::abs(other - z) < kStorey; });
    if (apart) found.push_back(z);
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// m, of the ceiling under the next floor along the wall.
double ceiling_under(const Segmentation& segmentation, const Levels& levels, const WallCandidate& wall,
                     double floor) {
  double ceiling = floor;
  double max_along = kAlong;
  for (std::size_t h = 0; h < segmentation.horizontals.size(); ++h) {
    const HorizontalSurface& surface = segmentation.horizontals[h];
    if (surface.z >= floor || surface.z < floor - kSlab || levels.ceiling_score(h) <= 0) continue;
    const double along = along_fraction(wall, surface);
    if (along > max_along) max_along = along, ceiling = surface.z;
  }
  return ceiling;
}

std::vector<WallCandidate> by_storey(const Segmentation& segmentation, const Levels& levels,
                                     const WallCandidate& wall) {
  const std::vector<double> floors = upper_floors(segmentation, levels, wall);
  std::vector<WallCandidate> storeys;
  for (std::size_t k = 0; k <= floors.size(); ++k) {
    WallCandidate storey = wall;
    if (k > 0) storey.floor = floors[k - 1], storey.z_low = std::max(wall.z_low, floors[k - 1]);
    if (k < floors.size()) {
      storey.ceiling = ceiling_under(segmentation, levels, wall, floors[k]);
      storey.z_high = std::min(wall.z_high, storey.ceiling);
    }
    if (storey.z_high > storey.z_low) storeys.push_back(std::move(storey));
  }
  return storeys;
}

}  // namespace

std::vector<std::size_t> split_by_storey(const Segmentation& segmentation, const Levels& levels,
                                         std::vector<WallCandidate>& walls) {
  std::vector<std::size_t> changed;
  for (std::size_t w = 0, n = walls.size(); w < n; ++w) {
    if (walls[w].curve != kNoCurve || walls[w].score <= 0 || walls[w].z_high - walls[w].floor < 2 * kStorey)
      continue;
    std::vector<WallCandidate> storeys = by_storey(segmentation, levels, walls[w]);
    if (storeys.size() < 2) continue;
    for (std::size_t k = 0; k < storeys.size(); ++k) {
      changed.push_back(k == 0 ? w : walls.size());
      if (k == 0)
        walls[w] = std::move(storeys[k]);
      else
        walls.push_back(std::move(storeys[k]));
    }
  }
  return changed;
}

bool on_same_storey(const WallCandidate& a, const WallCandidate& b) {
  const double lower = std::min(a.ceiling - a.floor, b.ceiling - b.floor);
  return std::min(a.ceiling, b.ceiling) - std::max(a.floor, b.floor) > 0.5 * lower;
}

}  // namespace parhelion::semantic
