// The two searches of the image-based pipeline, over one site cut into tiles. Internal to this module.
//
// Each tile is processed with a margin of one block around it, wide enough that its core does not depend on
// the tile boundaries; a surface belongs to the tile that contains its middle.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/segmentation/pixel_set.hpp"
#include "fusion/semantic/segmentation/plan_blocks.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"

namespace parhelion::semantic {

constexpr double kHeightMargin = 0.5;  ///< m, kept free below the lowest and above the highest point
constexpr int kBlockPixels = 64;       ///< side of a block
constexpr int kTileBlocks = 8;         ///< 512 pixels, the paper's picture
constexpr int kImagePixels = (kTileBlocks + 2) * kBlockPixels + 2;  ///< a tile, its margins and a border
constexpr int kBlockCells = 16;  ///< horizontal surfaces are found per cell

struct Tile {
  int x = 0, y = 0;  ///< in tiles from the origin
};

/// A cloud, sorted and with its bounds, for the searches.
struct Site {
  const cloud::PointCloud<Map>& cloud;
  const SegmentationOptions& options;
  PlanBlocks blocks;
  std::vector<std::uint8_t> cells;  ///< per point in the order of the blocks: its cell of its block
  std::vector<Tile> tiles;          ///< those with points, by y, then x
  double z_low = 0, z_high = 0;     ///< m, of all points except outliers, with the margin

  double cell() const { return options.pixel * kBlockPixels / kBlockCells; }
};

/// One set pixel of one stage; z rows count from the lowest.
struct StagePixel {
  std::int32_t x, y;   ///< pixels from the origin; y of OXZ and OYZ from one pixel under `z_low`
  std::uint8_t value;  ///< layers, 1 to 64
};
enum class Stage : std::uint8_t { input, threshold, filtered, dilated, skeleton };
enum class Projection : std::uint8_t { oxy, oxz, oyz };

/// Collects the pixels and lines of the stage pictures.
struct StageImages {
  std::vector<StagePixel> pixels[3][5];  ///< [Projection][Stage]
  struct Line {
    Eigen::Vector2d a, b;  ///< m, in the picture's two axes
  };
  std::vector<Line> hough[3];
};

/// Writes them into the folder as PNG files, oxy_1_input.png and so on, and the surfaces found.
Status write_stages(const std::string& folder, const Site& site, const StageImages& stages,
                    const Segmentation& found);

/// A cell of the plan at one height that a horizontal surface covers.
struct Plate {
  std::int32_t x = 0, y = 0;                         ///< cell, counted from the origin
  float z = 0;                                       ///< m, mean of its points
  float variance = 0;                                ///< m^2
  std::uint32_t points = 0;                          ///< within `near` of z
  std::uint32_t beside = 0;                          ///< in bands of the same width above and below
  std::uint32_t around = 0;                          ///< within the height of two steps above and below
  std::uint32_t from_above = 0, from_below = 0;      ///< points by the side they were seen from
  std::uint32_t column_above = 0, column_below = 0;  ///< the cell's other points
  std::uint32_t surface = kNoSurface;                ///< into HorizontalSearch::surfaces
};

struct HorizontalSearch {
  std::vector<HorizontalSurface> surfaces;
  std::vector<Plate> plates;         ///< of these surfaces, by block (as in Site), then cell
  std::vector<std::uint32_t> first;  ///< per block and one more: range in `plates`
};
/// The plates of one block, by cell.
class BlockPlates {
 public:
  BlockPlates(const Site& site, const HorizontalSearch& horizontals, std::size_t block);
  /// Plates of a cell of the block.
  std::span<const Plate> at(std::uint8_t cell) const {
    return plates_.subspan(first_[cell], static_cast<std::size_t>(first_[cell + 1U] - first_[cell]));
  }
  /// Whether a single plate explains a point of this height (m) in a cell: it is within 2.5 sigma.
  bool lies_flat(std::uint8_t cell, float z) const;

 private:
  std::span<const Plate> plates_;
  std::array<std::uint16_t, kBlockCells * kBlockCells + 1> first_{};
  std::span<const HorizontalSurface> surfaces_;
  double near_ = 0;
};

HorizontalSearch find_horizontals(const Site& site, StageImages* stages);

/// Segments of the plan; fields that depend on single points (heights, thickness, count) are still empty.
std::vector<VerticalSurface> find_verticals(const Site& site, const HorizontalSearch& horizontals,
                                            StageImages* stages);

/// Assigns each point to its surface and computes each surface's figures from its points.
void assign_points(const Site& site, const HorizontalSearch& horizontals, Segmentation& result);

std::vector<ParallelSet> find_parallel_sets(const std::vector<VerticalSurface>& verticals);

/// The four images between projection and Hough transform.
struct ImageChain {
  LayerImage input;
  PixelSet above_threshold, filtered, dilated, skeleton;
  /// From `above_threshold` to `skeleton`.
  void run();
  void keep(Projection projection, int x0, int y0, int x1, int y1, int offset_x, int offset_y,
            StageImages& stages) const;
};

}  // namespace parhelion::semantic
