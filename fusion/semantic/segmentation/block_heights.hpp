// The points of one block of the plan by height and by cell, for the search of plates at many heights.
// Internal to find_horizontals.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/semantic/segmentation/surface_search.hpp"

namespace parhelion::semantic {

/// The cost of one height depends on the points near it, not on all of the block.
class BlockHeights {
 public:
  /// `site` and `block` must outlive it.
  BlockHeights(const Site& site, const PlanBlocks::Block& block);

  /// Appends the block's cells, in their order, at the height near `level` (m) where it has the most points.
  void add_plates(double level, std::vector<Plate>& plates);

 private:
  static constexpr std::size_t kCells = std::size_t{kBlockCells} * kBlockCells;
  struct Sums {
    std::array<double, kCells> sum{}, squares{};  ///< m, m^2, from the height
    std::array<std::uint32_t, kCells> points{}, beside{}, from_above{}, from_below{};
  };
  std::size_t band_of(double z) const;
  float height(std::uint32_t place) const { return site_.blocks.sorted()[block_.begin + place].z(); }
  template <class Visit>
  void for_each_between(double low, double high, Visit&& visit) const;
  double densest(double level) const;
  Sums sums_at(double z);
  void count_column(std::size_t cell, double z, Plate& plate);
  void gather_in_cells();

  const Site& site_;
  const PlanBlocks::Block& block_;
  std::span<const std::uint8_t> cell_of_;  ///< per point of the block
  std::vector<std::uint32_t> band_begin_;  ///< per band of `near` height and one more: into by_band_
  std::vector<std::uint32_t> by_band_;     ///< points of the block, ascending within a band
  std::array<std::uint32_t, kCells + 1> cell_begin_{};
  std::vector<float> cell_heights_;  ///< m, by cell
  std::array<std::uint8_t, kCells>
      asked_{};                      ///< how often a cell was asked; from some number on it is sorted
  std::vector<std::uint64_t> near_;  ///< a bit per point of the block; all 0 between calls
};

}  // namespace parhelion::semantic
