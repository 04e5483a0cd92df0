// Assigns each point to its surface, and computes each surface's figures from its points.
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "fusion/semantic/segmentation/surface_search.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {

BlockPlates::BlockPlates(const Site& site, const HorizontalSearch& horizontals, std::size_t block)
    : surfaces_(horizontals.surfaces), near_(site.options.near) {
  const int x0 = site.blocks.blocks()[block].x * kBlockCells,
            y0 = site.blocks.blocks()[block].y * kBlockCells;
  plates_ = std::span(horizontals.plates)
                .subspan(horizontals.first[block], horizontals.first[block + 1] - horizontals.first[block]);
  for (const Plate& plate : plates_)
    ++first_[static_cast<std::size_t>((plate.y - y0) * kBlockCells + plate.x - x0 + 1)];
  for (std::size_t c = 1; c < first_.size(); ++c)
    first_[c] = static_cast<std::uint16_t>(first_[c] + first_[c - 1]);
}

bool BlockPlates::lies_flat(std::uint8_t cell, float z) const {
  constexpr double at_least = 0.02;  // m, the noise of a good scanner
  return std::ranges::any_of(at(cell), [&](const Plate& plate) {
    // Of the whole surface: a cell at the foot of a riser has a different spread.
    const double spread = 1.25 * surfaces_[plate.surface].thickness;
    return std::abs(static_cast<double>(z - plate.z)) <= std::clamp(spread, at_least, near_);
  });
}

namespace {

/// Which vertical surfaces pass near which block: pairs (block, surface), sorted.
std::vector<std::pair<std::uint32_t, std::uint32_t>> near_blocks(
    const Site& site, const std::vector<VerticalSurface>& surfaces) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  const double side = site.blocks.side(), margin = site.options.near * 1.5;
  for (std::uint32_t s = 0; s < surfaces.size(); ++s) {
    const Eigen::Vector2d low = surfaces[s].start.cwiseMin(surfaces[s].end);
    const Eigen::Vector2d high = surfaces[s].start.cwiseMax(surfaces[s].end);
    const Eigen::Vector2d d = (surfaces[s].end - surfaces[s].start).normalized();
    for (int y = site.blocks.coordinate(low.y() - margin); y <= site.blocks.coordinate(high.y() + margin);
         ++y) {
      double x0 = low.x(), x1 = high.x();
      if (std::abs(d.y()) > 0.05) {
        const double slope = d.x() / d.y();
        const double at0 = surfaces[s].start.x() + (y * side - margin - surfaces[s].start.y()) * slope;
        const double at1 = surfaces[s].start.x() + ((y + 1) * side + margin - surfaces[s].start.y()) * slope;
        x0 = std::max(x0, std::min(at0, at1));
        x1 = std::min(x1, std::max(at0, at1));
      }
      site.blocks.for_each_in(site.blocks.coordinate(x0 - margin), y, site.blocks.coordinate(x1 + margin), y,
                              [&](const PlanBlocks::Block&, std::size_t b) {
                                pairs.emplace_back(static_cast<std::uint32_t>(b), s);
                              });
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// A vertical surface prepared for distance queries.
struct Band {
  Eigen::Vector2d p, d;
  double length;
  std::uint32_t index;
  explicit Band(const VerticalSurface& s, std::uint32_t i)
      : p(s.start), d((s.end - s.start).normalized()), length((s.end - s.start).norm()), index(i) {}
  double across(const Eigen::Vector2d& q) const { return d.x() * (q.y() - p.y()) - d.y() * (q.x() - p.x()); }
  /// m from the plane; large where beyond the segment's ends by more than `near`.
  double distance(const Eigen::Vector2d& q, double near) const {
    const double along = d.dot(q - p);
    return along < -near || along > length + near ? 1e9 : std::abs(across(q));
  }
};

void assign_block(const Site& site, const HorizontalSearch& horizontals, std::size_t b,
                  const std::vector<Band>& bands, std::uint32_t verticals,
                  std::vector<std::uint32_t>& surface_of) {
  const BlockPlates plates(site, horizontals, b);
  const PlanBlocks::Block& block = site.blocks.blocks()[b];
  const double near = site.options.near;
  for (std::uint32_t i = block.begin; i < block.end; ++i) {
    const Eigen::Vector3f& p = site.blocks.sorted()[i];
    const Eigen::Vector2d q = p.head<2>().cast<double>();
    double nearest = near;
    std::uint32_t surface = kNoSurface;
    for (const Band& band : bands) {
      const double distance = band.distance(q, near);
      if (distance > nearest) continue;
      nearest = distance;
      surface = band.index;
    }
    for (const Plate& plate : plates.at(site.cells[i])) {
      const double distance = std::abs(static_cast<double>(p.z() - plate.z));
      if (distance > nearest) continue;
      nearest = distance;
      surface = verticals + plate.surface;
    }
    surface_of[site.blocks.order()[i]] = surface;
  }
}

/// Heights, thickness and number of the points assigned to a vertical surface.
void measure(const Site& site, const std::vector<std::uint32_t>& surface_of, std::uint32_t index,
             std::span<const std::uint32_t> blocks, VerticalSurface& surface) {
  std::vector<float> heights;
  double squares = 0;
  const Band band(surface, index);
  for (const std::uint32_t b : blocks) {
    const PlanBlocks::Block& block = site.blocks.blocks()[b];
    for (std::uint32_t i = block.begin; i < block.end; ++i) {
      if (surface_of[site.blocks.order()[i]] != index) continue;
      const Eigen::Vector3f& p = site.blocks.sorted()[i];
      heights.push_back(p.z());
      const double across = band.across(p.head<2>().cast<double>());
      squares += across * across;
    }
  }
  surface.points = static_cast<std::uint32_t>(heights.size());
  if (heights.empty()) return;
  surface.z_low = static_cast<double>(quantile(heights, 0.01));
  surface.z_high = static_cast<double>(quantile(heights, 0.99));
  surface.thickness = 2 * std::sqrt(squares / static_cast<double>(heights.size()));
}

}  // namespace

void assign_points(const Site& site, const HorizontalSearch& horizontals, Segmentation& result) {
  result.surface_of.assign(site.cloud.size(), kNoSurface);
  const auto pairs = near_blocks(site, result.verticals);
  const auto count = static_cast<std::uint32_t>(result.verticals.size());
  tbb::parallel_for(std::size_t{0}, site.blocks.blocks().size(), [&](std::size_t b) {
    std::vector<Band> bands;
    for (auto it = std::lower_bound(pairs.begin(), pairs.end(), std::pair{static_cast<std::uint32_t>(b), 0U});
         it != pairs.end() && it->first == b; ++it)
      bands.emplace_back(result.verticals[it->second], it->second);
    assign_block(site, horizontals, b, bands, count, result.surface_of);
  });

  std::vector<std::vector<std::uint32_t>> blocks_of(count);
  for (const auto& [block, surface] : pairs) blocks_of[surface].push_back(block);
  tbb::parallel_for(std::uint32_t{0}, count, [&](std::uint32_t s) {
    measure(site, result.surface_of, s, blocks_of[s], result.verticals[s]);
  });
  for (HorizontalSurface& surface : result.horizontals) surface.points = 0;
  for (const std::uint32_t surface : result.surface_of) {
    if (surface != kNoSurface && surface >= count) ++result.horizontals[surface - count].points;
  }
}

}  // namespace parhelion::semantic
