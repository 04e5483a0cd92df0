#include "fusion/semantic/segmentation/join_plates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

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

bool of_one_height(const Plate& a, const Plate& b) {
  return static_cast<double>(std::abs(b.z - a.z)) <= height_step(a, b);
}

/// Whether the plate contains more of the points around its height than a wall's slice does by chance. Such
/// slices are not flat; nor is the floor's rim at the foot of a wall.
bool is_flat(const Plate& plate) {
  const double n = plate.points + plate.around, mean = kSliceFraction * n;
  return plate.points > mean + 2 * std::sqrt(mean * (1 - kSliceFraction));
}

/// Ascends with y, then x.
std::int64_t cell_key(std::int64_t x, std::int64_t y) { return (y << 32) + x; }

constexpr float kFarthest = 0.031F;  // m, a little more than kMaxHeightStep

}  // namespace

bool by_place(const Plate& a, const Plate& b) {
  const std::int64_t one = cell_key(a.x, a.y), other = cell_key(b.x, b.y);
  return one != other ? one < other : a.z < b.z;
}

std::vector<std::uint32_t> join_plates(const std::vector<Plate>& plates) {
  std::vector<std::uint32_t> parent(plates.size()), host(plates.size(), kNoSurface);
  std::iota(parent.begin(), parent.end(), 0U);
  // What a plate's neighbours need of it first, close together in memory.
  std::vector<std::int64_t> cell;
  std::vector<float> z;
  std::vector<std::uint8_t> flat;
  for (const Plate& plate : plates) {
    cell.push_back(cell_key(plate.x, plate.y));
    z.push_back(plate.z);
    flat.push_back(is_flat(plate) ? 1 : 0);
  }
  const auto adopt = [&](std::uint32_t i, std::uint32_t child) {
    const auto apart = [&](std::uint32_t k) { return std::abs(plates[k].z - plates[child].z); };
    if (host[child] == kNoSurface || apart(i) < apart(host[child])) host[child] = i;
  };
  const auto meet = [&](std::uint32_t i, std::uint32_t j) {
    const bool one = flat[i] != 0, other = flat[j] != 0;
    if ((!one && !other) || !of_one_height(plates[i], plates[j])) return;
    if (one && other) {
      const auto a = root(parent, i), b = root(parent, j);
      parent[std::max(a, b)] = std::min(a, b);
    }
    if (one && !other) adopt(i, j);
    if (other && !one) adopt(j, i);
  };
  // Where the neighbours in each row begin and end: these places move on with the plates.
  struct Range {
    std::uint32_t begin = 0, end = 0;
  };
  std::array<Range, kReachCells + 1> rows{};
  for (std::uint32_t i = 0; i < cell.size(); ++i) {
    for (int dy = 0; dy <= kReachCells; ++dy) {
      const std::int64_t from = cell[i] + cell_key(dy == 0 ? 1 : -kReachCells, dy),
                         to = cell[i] + cell_key(kReachCells, dy);
      auto& [begin, end] = rows[static_cast<std::size_t>(dy)];
      while (begin < cell.size() && cell[begin] < from) ++begin;
      end = std::max(begin, end);
      while (end < cell.size() && cell[end] <= to) ++end;
      for (std::uint32_t j = begin; j < end; ++j) {
        // Most are at other heights.
        if (std::abs(z[j] - z[i]) <= kFarthest) meet(i, j);
      }
    }
  }
  std::vector<std::uint32_t> part(plates.size());
  for (std::uint32_t i = 0; i < plates.size(); ++i)
    part[i] = root(parent, host[i] == kNoSurface ? i : host[i]);
  return part;
}

}  // namespace parhelion::semantic
