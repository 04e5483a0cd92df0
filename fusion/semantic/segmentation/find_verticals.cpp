// Vertical surfaces: a vertical surface is a line in the plan (OXY). Pictures propose lines, points decide.
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "fusion/cloud/floor_index.hpp"
#include "fusion/semantic/segmentation/hough.hpp"
#include "fusion/semantic/segmentation/line_refiner.hpp"
#include "fusion/semantic/segmentation/plan_arcs.hpp"
#include "fusion/semantic/segmentation/surface_search.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kLayerHeight = 0.04;  // m; 64 of them wrap at 2.56 m
constexpr int kMinLayers = 3;  // about 0.12 m: less than the riser of a step, more than a floor's noise

struct TileLines {
  std::vector<PlanLine> seeds;
  std::vector<Eigen::Vector3f> evidence;  ///< x, y (m), weight of the pixels of the tile's core
};

/// Per point, in the order of the blocks: whether it lies on a horizontal surface.
std::vector<std::uint8_t> flat_points(const Site& site, const HorizontalSearch& horizontals) {
  std::vector<std::uint8_t> flat(site.blocks.sorted().size());
  tbb::parallel_for(std::size_t{0}, site.blocks.blocks().size(), [&](std::size_t b) {
    const PlanBlocks::Block& block = site.blocks.blocks()[b];
    const BlockPlates plates(site, horizontals, b);
    for (std::uint32_t i = block.begin; i < block.end; ++i)
      flat[i] = plates.lies_flat(site.cells[i], site.blocks.sorted()[i].z());
  });
  return flat;
}

class TilePlan {
 public:
  TilePlan(const Site& site, const std::vector<std::uint8_t>& flat, Tile tile)
      : site_(site), flat_(flat), tile_(tile) {
    x0_ = (tile.x * kTileBlocks - 1) * kBlockPixels - 1;
    y0_ = (tile.y * kTileBlocks - 1) * kBlockPixels - 1;
  }

  TileLines search(StageImages* stages) {
    chain_.input.reset(kImagePixels, kImagePixels);
    for_each_point(1, [&](const Eigen::Vector3f& p, int x, int y) {
      const double layer = std::floor(static_cast<double>(p.z()) / kLayerHeight);
      // Outlier points may be anywhere.
      chain_.input.add(x, y, static_cast<int>(std::clamp(layer, -1e6, 1e6)));
    });
    threshold(chain_.input, kMinLayers, chain_.above_threshold);
    chain_.run();
    TileLines result{seeds(stages), evidence()};
    const int core = kBlockPixels + 1, end = kImagePixels - kBlockPixels - 1;
    if (stages != nullptr) chain_.keep(Projection::oxy, core, core, end, end, x0_, y0_, *stages);
    return result;
  }

 private:
  /// visit(point, x, y in the image) for points that lie on no horizontal surface.
  template <class Visit>
  void for_each_point(int margin, Visit&& visit) const {
    const double per_pixel = 1 / site_.options.pixel;
    const int bx = tile_.x * kTileBlocks, by = tile_.y * kTileBlocks;
    site_.blocks.for_each_in(bx - margin, by - margin, bx + kTileBlocks - 1 + margin,
                             by + kTileBlocks - 1 + margin, [&](const PlanBlocks::Block& block, std::size_t) {
                               for (std::uint32_t i = block.begin; i < block.end; ++i) {
                                 if (flat_[i]) continue;
                                 const Eigen::Vector3f& p = site_.blocks.sorted()[i];
                                 const int x = cloud::floor_index(p.x() * per_pixel) - x0_;
                                 const int y = cloud::floor_index(p.y() * per_pixel) - y0_;
                                 if (chain_.input.inside(x, y)) visit(p, x, y);
                               }
                             });
  }

  Eigen::Vector2d metres(int x, int y) const {
    return Eigen::Vector2d(x + x0_ + 0.5, y + y0_ + 0.5) * site_.options.pixel;
  }

  std::vector<PlanLine> seeds(StageImages* stages) const {
    const int shortest = std::max(4, static_cast<int>(site_.options.min_length / site_.options.pixel));
    const HoughOptions hough{.votes = shortest / 2,
                             .min_length = shortest / 2,
                             .max_gap = shortest / 2,
                             .seed = site_.options.seed};
    std::vector<PlanLine> lines;
    for (const PixelSegment& s : hough_segments(chain_.skeleton, hough)) {
      const Eigen::Vector2d a = metres(s.x0, s.y0), b = metres(s.x1, s.y1), middle = (a + b) / 2;
      // Half a block beyond the core as well: two tiles may each place the middle on the other's side.
      const int x = (s.x0 + s.x1) / 2, y = (s.y0 + s.y1) / 2;
      constexpr int low = kBlockPixels / 2, high = kImagePixels - kBlockPixels / 2;
      if (x < low || y < low || x >= high || y >= high) continue;
      lines.push_back({middle, (b - a).normalized(), -(b - a).norm() / 2, (b - a).norm() / 2, 0});
      if (stages != nullptr) stages->hough[static_cast<int>(Projection::oxy)].push_back({a, b});
    }
    return lines;
  }

  /// The pixels of the core above the threshold: the mean of their points, weighted by the number of occupied
  /// layers, so that a stretch close to the scanner has the same weight as one far away. Not the filtered
  /// ones: far away a wall is hit in single columns.
  std::vector<Eigen::Vector3f> evidence() const {
    static thread_local std::vector<std::uint32_t> slot;
    slot.resize(static_cast<std::size_t>(kImagePixels) * kImagePixels);
    const auto& set = chain_.above_threshold.set();
    for (std::uint32_t k = 0; k < set.size(); ++k) slot[set[k]] = k;
    std::vector<Eigen::Vector3d> sums(set.size(), Eigen::Vector3d::Zero());
    for_each_point(0, [&](const Eigen::Vector3f& p, int x, int y) {
      const std::uint32_t i = chain_.above_threshold.index(x, y);
      if (!chain_.above_threshold.at(i)) return;
      sums[slot[i]] += Eigen::Vector3d(static_cast<double>(p.x()), static_cast<double>(p.y()), 1);
    });
    std::vector<Eigen::Vector3f> result;
    for (std::uint32_t k = 0; k < set.size(); ++k) {
      const double count = sums[k].z();
      if (count <= 0) continue;
      result.emplace_back(static_cast<float>(sums[k].x() / count), static_cast<float>(sums[k].y() / count),
                          static_cast<float>(std::popcount(chain_.input.layers(set[k]))));
    }
    return result;
  }

  const Site& site_;
  const std::vector<std::uint8_t>& flat_;
  Tile tile_;
  int x0_ = 0, y0_ = 0;
  static thread_local ImageChain chain_;  // large; only set pixels are cleared
};
thread_local ImageChain TilePlan::chain_;

/// Best supported first; each removes its evidence from later ones.
std::vector<PlanLine> select(LineRefiner& refiner, std::vector<PlanLine> seeds) {
  std::vector<std::optional<PlanLine>> refined(seeds.size());
  tbb::parallel_for(std::size_t{0}, seeds.size(),
                    [&](std::size_t i) { refined[i] = refiner.refine(seeds[i]); });
  std::vector<PlanLine> lines;
  for (const auto& line : refined) {
    if (line) lines.push_back(*line);
  }
  std::stable_sort(lines.begin(), lines.end(),
                   [](const PlanLine& a, const PlanLine& b) { return a.weight > b.weight; });
  std::vector<PlanLine> chosen;
  for (const PlanLine& line : lines) {
    auto again = refiner.refine(line);
    if (!again) continue;
    refiner.extend_to_corners(*again);
    refiner.claim(*again);
    chosen.push_back(*again);
  }
  return chosen;
}

}  // namespace

std::vector<VerticalSurface> find_verticals(const Site& site, const HorizontalSearch& horizontals,
                                            StageImages* stages) {
  const std::vector<std::uint8_t> flat = flat_points(site, horizontals);
  std::vector<TileLines> of_tiles(site.tiles.size());
  const auto search = [&](std::size_t t) {
    of_tiles[t] = TilePlan(site, flat, site.tiles[t]).search(stages);
  };
  if (stages != nullptr) {
    for (std::size_t t = 0; t < of_tiles.size(); ++t) search(t);
  } else {
    tbb::parallel_for(std::size_t{0}, of_tiles.size(), search);
  }
  TileLines all;
  for (const TileLines& of_tile : of_tiles) {
    all.seeds.insert(all.seeds.end(), of_tile.seeds.begin(), of_tile.seeds.end());
    all.evidence.insert(all.evidence.end(), of_tile.evidence.begin(), of_tile.evidence.end());
  }
  of_tiles.clear();
  LineRefiner refiner(all.evidence, site.options.pixel, site.options.near, site.options.min_length);
  std::vector<PlanLine> lines = select(refiner, std::move(all.seeds));
  const std::vector<PlanArc> arcs =
      find_arcs(refiner.evidence(), site.options.near, site.options.min_length, lines);
  std::vector<VerticalSurface> surfaces;
  for (const PlanLine& line : lines) {
    VerticalSurface surface;
    surface.start = line.p + line.low * line.d;
    surface.end = line.p + line.high * line.d;
    surfaces.push_back(surface);
  }
  for (std::uint32_t a = 0; a < arcs.size(); ++a) {
    const std::vector<Eigen::Vector2d> corners = corners_of(arcs[a], site.options.near);
    for (std::size_t i = 1; i < corners.size(); ++i) {
      VerticalSurface facet;
      facet.start = corners[i - 1];
      facet.end = corners[i];
      facet.curve = a;
      surfaces.push_back(facet);
    }
  }
  return surfaces;
}

}  // namespace parhelion::semantic
