#include "fusion/semantic/segmentation/side_pictures.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/cloud/floor_index.hpp"
#include "fusion/semantic/segmentation/hough.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kMinLine = 0.2;        // m; less than the tread of a step
constexpr int kMinLayers = 3;           // of 64 across tile and margins: 0.4 m deep, or a wall seen end on
constexpr double kRidgeReach = 0.12;    // m; less than the distance between steps
constexpr double kRidgeFraction = 0.6;  // of the largest layer count in reach
constexpr int kMaxRise = 3;             // degrees: steeper surfaces are ramps

/// One tile's pictures from the side; x is along the picture, in site pixels.
class SidePictures {
 public:
  SidePictures(const Site& site, Tile tile) : site_(site) {
    x0_ = (tile.x * kTileBlocks - 1) * kBlockPixels - 1;
    y0_ = (tile.y * kTileBlocks - 1) * kBlockPixels - 1;
    rows_ = static_cast<int>((site.z_high - site.z_low) / site.options.pixel) + 3;
    for (ImageChain& chain : chains_) chain.input.reset(kImagePixels, rows_);
    const int bx = tile.x * kTileBlocks, by = tile.y * kTileBlocks;
    site.blocks.for_each_in(bx - 1, by - 1, bx + kTileBlocks, by + kTileBlocks,
                            [&](const PlanBlocks::Block& block, std::size_t) { add(block); });
  }

  /// Level lines, as heights (m) over blocks: [block column or row 0..9] -> heights.
  using Levels = HeightsByBlock;
  Levels levels(Projection projection, StageImages* stages) {
    ImageChain& chain = chains_[projection == Projection::oxz ? 0 : 1];
    threshold_ridges(chain.input, kMinLayers, static_cast<int>(kRidgeReach / site_.options.pixel),
                     kRidgeFraction, chain.above_threshold);
    chain.run();
    const int offset = projection == Projection::oxz ? x0_ : y0_;
    if (stages != nullptr)
      chain.keep(projection, kBlockPixels + 1, 0, kImagePixels - kBlockPixels - 1, rows_, offset, 0, *stages);
    const double pixel = site_.options.pixel;
    const int shortest = std::max(3, static_cast<int>(kMinLine / pixel));
    const HoughOptions hough{shortest * 2 / 3, shortest, shortest / 2, kMaxRise, site_.options.seed};
    Levels result;
    add_full_rows(chain.above_threshold, shortest, result);
    for (const PixelSegment& s : hough_segments(chain.skeleton, hough)) {
      spread(s, result);
      if (stages != nullptr) {
        const auto metres = [&](int x, int y) {
          return Eigen::Vector2d((x + offset + 0.5) * pixel, site_.z_low + (y - 0.5) * pixel);
        };
        stages->hough[static_cast<int>(projection)].push_back({metres(s.x0, s.y0), metres(s.x1, s.y1)});
      }
    }
    return result;
  }

 private:
  void add(const PlanBlocks::Block& block) {
    const double per_pixel = 1 / site_.options.pixel;
    for (std::uint32_t i = block.begin; i < block.end; ++i) {
      const Eigen::Vector3f& p = site_.blocks.sorted()[i];
      const double height = (static_cast<double>(p.z()) - site_.z_low) * per_pixel;
      if (!(height >= 0 && height < rows_ - 2)) continue;
      const int z = static_cast<int>(height) + 1;
      const int x = cloud::floor_index(p.x() * per_pixel) - x0_;
      const int y = cloud::floor_index(p.y() * per_pixel) - y0_;
      if (chains_[0].input.inside(x, z)) chains_[0].input.add(x, z, y * 64 / kImagePixels);
      if (chains_[1].input.inside(y, z)) chains_[1].input.add(y, z, x * 64 / kImagePixels);
    }
  }

  /// Finds what the random Hough transform may miss: rows with more pixels than those around them, over each
  /// block and half of its neighbours.
  void add_full_rows(const PixelSet& image, int shortest, Levels& levels) const {
    constexpr int half = kBlockPixels / 2, halves = 2 * (kTileBlocks + 2), rows_beside = 3;
    std::vector<std::array<std::int32_t, halves>> counts(static_cast<std::size_t>(rows_));
    for (const std::uint32_t i : image.set()) {
      const int x = static_cast<int>(i) % image.width(), y = static_cast<int>(i) / image.width();
      ++counts[static_cast<std::size_t>(y)][static_cast<std::size_t>((x - 1) / half)];
    }
    for (int b = 0; b < kTileBlocks + 2; ++b) {
      const auto count = [&](int row) {
        int sum = 0;
        for (int h = std::max(0, 2 * b - 1); h < std::min(halves, 2 * b + 3) && row > 0 && row < rows_; ++h)
          sum += counts[static_cast<std::size_t>(row)][static_cast<std::size_t>(h)];
        return sum;
      };
      for (int row = 1; row < rows_; ++row) {
        const int here = count(row);
        bool fullest = here >= shortest;
        for (int d = 1; d <= rows_beside && fullest; ++d)
          fullest = here > count(row - d) && here >= count(row + d);
        if (fullest)
          levels[static_cast<std::size_t>(b)].push_back(site_.z_low + (row - 0.5) * site_.options.pixel);
      }
    }
  }

  void spread(const PixelSegment& s, Levels& levels) const {
    const auto [low, high] = std::minmax(s.x0, s.x1);
    for (int b = (low - 1) / kBlockPixels; b <= (high - 1) / kBlockPixels; ++b) {
      const double centre = std::clamp(1 + (b + 0.5) * kBlockPixels, low + 0.0, high + 0.0);
      const double row = s.y0 + (s.y1 - s.y0) * (centre - s.x0) / (s.x1 - s.x0);
      levels[static_cast<std::size_t>(b)].push_back(site_.z_low + (row - 0.5) * site_.options.pixel);
    }
  }

  const Site& site_;
  int x0_ = 0, y0_ = 0, rows_ = 0;
  static thread_local std::array<ImageChain, 2> chains_;  // large; only set pixels are cleared
};
thread_local std::array<ImageChain, 2> SidePictures::chains_;

}  // namespace

LevelLines level_lines(const Site& site, Tile tile, StageImages* stages) {
  SidePictures pictures(site, tile);
  LevelLines lines;
  lines.along_x = pictures.levels(Projection::oxz, stages);
  lines.along_y = pictures.levels(Projection::oyz, stages);
  return lines;
}

}  // namespace parhelion::semantic
