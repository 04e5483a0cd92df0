#include "fusion/semantic/segmentation/block_heights.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

namespace parhelion::semantic {
namespace {

constexpr std::uint32_t kFewPoints = 10;
constexpr double kAroundHeight = 0.3;  // m
constexpr std::uint8_t kFewTimes = 4;  // that a cell is asked; to sort it costs as much
constexpr double kRounding = 1e-6;     // m, more than a difference of heights is rounded by

/// -1 seen from below, 1 from above, 0 unknown.
int seen_from(const cloud::PointCloud<Map>& cloud, std::uint32_t i) {
  if (!cloud.viewpoints.empty()) {
    const std::size_t scan = cloud.scans.empty() ? 0 : cloud.scans[i];
    const double above = cloud.viewpoints[scan].z() - static_cast<double>(cloud.points[i].z());
    return above > 0 ? 1 : -1;
  }
  if (cloud.normals.empty() || std::abs(cloud.normals[i].z()) < 0.5F) return 0;
  return cloud.normals[i].z() > 0 ? 1 : -1;
}

}  // namespace

BlockHeights::BlockHeights(const Site& site, const PlanBlocks::Block& block)
    : site_(site),
      block_(block),
      cell_of_(std::span(site.cells).subspan(block.begin, block.end - block.begin)) {
  const std::uint32_t n = block.end - block.begin;
  near_.assign(n / 64 + 1, 0);
  band_begin_.assign(static_cast<std::size_t>((site.z_high - site.z_low) / site.options.near) + 2, 0);
  std::vector<std::uint32_t> band(n);
  for (std::uint32_t k = 0; k < n; ++k) {
    const Eigen::Vector3f& p = site.blocks.sorted()[block.begin + k];
    band[k] = static_cast<std::uint32_t>(band_of(p.z()));
    ++band_begin_[band[k] + 1];
  }
  std::partial_sum(band_begin_.begin(), band_begin_.end(), band_begin_.begin());
  by_band_.resize(n);
  std::vector<std::uint32_t> next(band_begin_.begin(), band_begin_.end() - 1);
  for (std::uint32_t k = 0; k < n; ++k) by_band_[next[band[k]]++] = k;
  gather_in_cells();
}

void BlockHeights::gather_in_cells() {
  for (const std::uint8_t cell : cell_of_) ++cell_begin_[cell + 1U];
  std::partial_sum(cell_begin_.begin(), cell_begin_.end(), cell_begin_.begin());
  cell_heights_.resize(cell_of_.size());
  std::array<std::uint32_t, kCells + 1> next = cell_begin_;
  for (std::uint32_t k = 0; k < cell_of_.size(); ++k) cell_heights_[next[cell_of_[k]]++] = height(k);
}

std::size_t BlockHeights::band_of(double z) const {
  const double band = (z - site_.z_low) / site_.options.near;
  return static_cast<std::size_t>(std::clamp(band, 0.0, static_cast<double>(band_begin_.size() - 2)));
}

/// visit(point of the block) for those of all bands that touch [low, high].
template <class Visit>
void BlockHeights::for_each_between(double low, double high, Visit&& visit) const {
  const std::uint32_t end = band_begin_[band_of(high + kRounding) + 1];
  for (std::uint32_t i = band_begin_[band_of(low - kRounding)]; i < end; ++i) visit(by_band_[i]);
}

/// Histogram of the block's points near `level`; returns the middle of the fullest stretch.
double BlockHeights::densest(double level) const {
  constexpr int bins = 40;
  const double near = site_.options.near, width = 2 * near / bins;
  std::array<int, bins> count{};
  for_each_between(level - near, level + near, [&](std::uint32_t k) {
    const double bin = (static_cast<double>(height(k)) - level + near) / width;
    if (bin >= 0 && bin < bins) ++count[static_cast<std::size_t>(bin)];
  });
  constexpr int window = 8;  // 2 cm of the default 10
  int sum = std::accumulate(count.begin(), count.begin() + window, 0), largest = sum, first = 0, last = 0;
  for (int b = 1; b + window <= bins; ++b) {
    sum += count[static_cast<std::size_t>(b + window - 1)] - count[static_cast<std::size_t>(b - 1)];
    if (sum > largest) {
      largest = sum;
      first = b;
    }
    if (sum == largest) last = b;
  }
  return level - near + ((first + std::max(first, last)) / 2.0 + window / 2.0) * width;
}

BlockHeights::Sums BlockHeights::sums_at(double z) {
  const double near = site_.options.near;
  Sums sums;
  for_each_between(z - 2 * near, z + 2 * near, [&](std::uint32_t k) {
    const double off = std::abs(static_cast<double>(height(k)) - z);
    if (off <= near)
      near_[k / 64] |= std::uint64_t{1} << (k % 64);
    else if (off <= 2 * near)
      ++sums.beside[cell_of_[k]];
  });
  // Added in the order of the points, which the bits give back: another order rounds differently.
  for (std::size_t word = 0; word < near_.size(); ++word) {
    for (; near_[word] != 0; near_[word] &= near_[word] - 1) {
      const auto k =
          static_cast<std::uint32_t>(64 * word) + static_cast<std::uint32_t>(std::countr_zero(near_[word]));
      const double dz = static_cast<double>(height(k)) - z;
      const std::size_t cell = cell_of_[k];
      ++sums.points[cell];
      sums.sum[cell] += dz;
      sums.squares[cell] += dz * dz;
      const int side = seen_from(site_.cloud, site_.blocks.order()[block_.begin + k]);
      sums.from_above[cell] += side > 0;
      sums.from_below[cell] += side < 0;
    }
  }
  return sums;
}

/// The points of the cell that are not on the plate.
void BlockHeights::count_column(std::size_t cell, double z, Plate& plate) {
  const std::span heights =
      std::span(cell_heights_).subspan(cell_begin_[cell], cell_begin_[cell + 1] - cell_begin_[cell]);
  const double near = site_.options.near;
  std::ptrdiff_t below = 0, above = 0, around = 0;  // under the plate; over it; less than kAroundHeight off
  if (asked_[cell]++ < kFewTimes) {
    for (const float at : heights) {
      const double dz = static_cast<double>(at) - z;
      below += dz < -near, above += !(dz <= near);
      around += !(dz < -kAroundHeight) & (dz <= kAroundHeight);
    }
  } else {
    if (asked_[cell] == kFewTimes + 1) std::sort(heights.begin(), heights.end());
    asked_[cell] = kFewTimes + 2;
    const auto first_from = [&](double dz) {
      return std::partition_point(heights.begin(), heights.end(),
                                  [&](float at) { return static_cast<double>(at) - z < dz; });
    };
    const auto first_over = [&](double dz) {
      return std::partition_point(heights.begin(), heights.end(),
                                  [&](float at) { return static_cast<double>(at) - z <= dz; });
    };
    below = first_from(-near) - heights.begin(), above = heights.end() - first_over(near);
    around = first_over(kAroundHeight) - first_from(-kAroundHeight);
  }
  plate.column_below = static_cast<std::uint32_t>(below);
  plate.column_above = static_cast<std::uint32_t>(above);
  const auto on_plate = std::ssize(heights) - below - above;
  plate.around = static_cast<std::uint32_t>(std::max<std::ptrdiff_t>(0, around - on_plate));
}

void BlockHeights::add_plates(double level, std::vector<Plate>& plates) {
  const double z = densest(level);
  const Sums sums = sums_at(z);
  for (std::size_t c = 0; c < kCells; ++c) {
    const std::uint32_t points = sums.points[c];
    // A few points may have some beside them by chance.
    if (points == 0 || points < sums.beside[c] * (points < kFewPoints ? 1U : 2U)) continue;
    Plate plate;
    plate.points = points, plate.beside = sums.beside[c];
    plate.from_above = sums.from_above[c], plate.from_below = sums.from_below[c];
    count_column(c, z, plate);
    const double mean = sums.sum[c] / points;
    plate.x = block_.x * kBlockCells + static_cast<int>(c % kBlockCells);
    plate.y = block_.y * kBlockCells + static_cast<int>(c / kBlockCells);
    plate.z = static_cast<float>(z + mean);
    plate.variance = static_cast<float>(std::max(0.0, sums.squares[c] / points - mean * mean));
    plates.push_back(plate);
  }
}

}  // namespace parhelion::semantic
