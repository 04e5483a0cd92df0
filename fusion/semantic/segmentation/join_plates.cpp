#include "fusion/semantic/segmentation/join_plates.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace parhelion::semantic {
namespace {

constexpr double kSameHeight = 0.008;    // m, between cells of one surface, in addition to noise
constexpr double kPointNoise = 0.01;     // m
constexpr double kMaxHeightStep = 0.03;  // m, independent of the noise
constexpr int kReachCells = 4;           // a gap of one cell does not split a surface
constexpr double kSliceFraction = 0.17;  // fraction of a wall's points in a slice: 0.1 m of 0.6 m

std::uint32_t root(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

/// m, maximum difference of two cells of one surface: 2.5 sigma of their means plus the floor's unevenness.
double height_step(const Plate& a, const Plate& b) {
  const double sigma = kPointNoise * std::sqrt(1.0 / a.points + 1.0 / b.points);
  return std::min(kMaxHeightStep, kSameHeight + 2.5 * sigma);
}

/// Whether the plate contains more of the points around its height than a wall's slice does by chance. Such
/// slices are not flat; nor is the floor's rim at the foot of a wall.
bool is_flat(const Plate& plate) {
  const double n = plate.points + plate.around, mean = kSliceFraction * n;
  return plate.points > mean + 2 * std::sqrt(mean * (1 - kSliceFraction));
}

}  // namespace

bool by_place(const Plate& a, const Plate& b) {
  return std::tuple(a.y, a.x, a.z) < std::tuple(b.y, b.x, b.z);
}

std::vector<std::uint32_t> join_plates(const std::vector<Plate>& plates) {
  std::vector<std::uint32_t> parent(plates.size()), host(plates.size(), kNoSurface);
  std::iota(parent.begin(), parent.end(), 0U);
  const auto adopt = [&](std::uint32_t i, std::uint32_t child) {
    const auto apart = [&](std::uint32_t k) { return std::abs(plates[k].z - plates[child].z); };
    if (host[child] == kNoSurface || apart(i) < apart(host[child])) host[child] = i;
  };
  const auto meet = [&](std::uint32_t i, std::uint32_t j) {
    if (static_cast<double>(std::abs(plates[j].z - plates[i].z)) > height_step(plates[i], plates[j])) return;
    const bool one = is_flat(plates[i]), other = is_flat(plates[j]);
    if (one && other) {
      const auto a = root(parent, i), b = root(parent, j);
      parent[std::max(a, b)] = std::min(a, b);
    }
    if (one && !other) adopt(i, j);
    if (other && !one) adopt(j, i);
  };
  for (std::uint32_t i = 0; i < plates.size(); ++i) {
    const Plate& plate = plates[i];
    for (int dy = 0; dy <= kReachCells; ++dy) {
      const Plate from{.x = plate.x + (dy == 0 ? 1 : -kReachCells), .y = plate.y + dy, .z = -1e9F};
      auto it = std::lower_bound(plates.begin() + i, plates.end(), from, by_place);
      for (; it != plates.end() && it->y == from.y && it->x <= plate.x + kReachCells; ++it)
        meet(i, static_cast<std::uint32_t>(it - plates.begin()));
    }
  }
  std::vector<std::uint32_t> part(plates.size());
  for (std::uint32_t i = 0; i < plates.size(); ++i)
    part[i] = root(parent, host[i] == kNoSurface ? i : host[i]);
  return part;
}

}  // namespace parhelion::semantic
