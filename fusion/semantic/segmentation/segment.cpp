// The image-based pipeline from cloud to surfaces.
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "fusion/cloud/floor_index.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"
#include "fusion/semantic/segmentation/surface_search.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kTallest = 200;  // m; few buildings are taller; a room in millimetres is

std::string check_options(const SegmentationOptions& o) {
  const auto inside = [](double value, double low, double high) { return value >= low && value <= high; };
  if (!inside(o.pixel, 0.002, 0.2)) return "pixel must be within 0.002 to 0.2 m";
  if (!inside(o.near, o.pixel, 1)) return "near must be within one pixel to 1 m";
  if (!inside(o.min_length, 4 * o.pixel, 10)) return "min_length must be within 4 pixels to 10 m";
  if (o.threads < 0) return "threads must not be negative";
  return "";
}

/// The 0.1th and 99.9th percentile of the heights, widened by a margin.
std::pair<double, double> robust_heights(const std::vector<Eigen::Vector3f>& points) {
  std::vector<float> z;
  const std::size_t step = std::max<std::size_t>(1, points.size() / 100'000);
  for (std::size_t i = 0; i < points.size(); i += step) z.push_back(points[i].z());
  return {static_cast<double>(quantile(z, 0.001)) - kHeightMargin,
          static_cast<double>(quantile(z, 0.999)) + kHeightMargin};
}

std::vector<Tile> tiles_of(const PlanBlocks& blocks) {
  const auto floor_div = [](int a) {
    return a >= 0 ? a / kTileBlocks : -((-a + kTileBlocks - 1) / kTileBlocks);
  };
  std::vector<Tile> tiles;
  for (const PlanBlocks::Block& block : blocks.blocks())
    tiles.push_back({floor_div(block.x), floor_div(block.y)});
  const auto before = [](const Tile& a, const Tile& b) { return std::pair{a.y, a.x} < std::pair{b.y, b.x}; };
  const auto same = [](const Tile& a, const Tile& b) { return a.y == b.y && a.x == b.x; };
  std::sort(tiles.begin(), tiles.end(), before);
  tiles.erase(std::unique(tiles.begin(), tiles.end(), same), tiles.end());
  return tiles;
}

std::vector<std::uint8_t> cells_of(const PlanBlocks& blocks, double cell) {
  static_assert(kBlockCells * kBlockCells <= 256);
  std::vector<std::uint8_t> cells(blocks.sorted().size());
  tbb::parallel_for(std::size_t{0}, blocks.blocks().size(), [&](std::size_t b) {
    const PlanBlocks::Block& block = blocks.blocks()[b];
    const double per_cell = 1 / cell;
    const auto along = [&](float at, int of_block) {
      return std::clamp(cloud::floor_index(at * per_cell) - of_block * kBlockCells, 0, kBlockCells - 1);
    };
    for (std::uint32_t i = block.begin; i < block.end; ++i) {
      const Eigen::Vector3f& p = blocks.sorted()[i];
      cells[i] = static_cast<std::uint8_t>(along(p.y(), block.y) * kBlockCells + along(p.x(), block.x));
    }
  });
  return cells;
}

Result<Segmentation> run(const cloud::PointCloud<Map>& cloud, const SegmentationOptions& options,
                         double z_low, double z_high) {
  Site site{cloud, options, PlanBlocks(cloud.points, options.pixel * kBlockPixels), {}, {}, z_low, z_high};
  site.cells = cells_of(site.blocks, site.cell());
  site.tiles = tiles_of(site.blocks);
  StageImages stages;
  StageImages* const kept = options.stages.empty() ? nullptr : &stages;
  const HorizontalSearch horizontals = find_horizontals(site, kept);
  Segmentation result;
  result.verticals = find_verticals(site, horizontals, kept);
  result.horizontals = horizontals.surfaces;
  assign_points(site, horizontals, result);
  result.parallels = find_parallel_sets(result.verticals);
  if (kept != nullptr) {
    if (Status written = write_stages(options.stages, site, stages, result); !written) return written.error();
  }
  return result;
}

}  // namespace

Result<Segmentation> segment(const cloud::PointCloud<Map>& cloud, const SegmentationOptions& options) {
  if (const std::string wrong = check_options(options); !wrong.empty())
    return Error{"segmentation: " + wrong};
  if (cloud.empty()) return Error{"segmentation: the cloud is empty; expected the points of a scan"};
  const auto heights = robust_heights(cloud.points);
  const double z_low = heights.first, z_high = heights.second;  // clang 14 captures no structured bindings
  if (z_high - z_low > kTallest) {
    std::ostringstream message;
    message << "segmentation: the site is " << std::lround(z_high - z_low)
            << " m high; expected metres: are the coordinates in millimetres?";
    return Error{message.str()};
  }
  tbb::task_arena arena(options.threads == 0 ? tbb::task_arena::automatic : options.threads);
  return arena.execute([&] { return run(cloud, options, z_low, z_high); });
}

}  // namespace parhelion::semantic
