#include <algorithm>
#include <bit>

#include "fusion/semantic/segmentation/surface_search.hpp"

namespace parhelion::semantic {

void ImageChain::run() {
  filter_isolated(above_threshold, filtered);
  dilate(filtered, dilated);
  skeleton.reset(dilated.width(), dilated.height());
  for (const std::uint32_t i : dilated.set()) skeleton.add(i);
  thin(skeleton);
}

void ImageChain::keep(Projection projection, int x0, int y0, int x1, int y1, int offset_x, int offset_y,
                      StageImages& stages) const {
  auto& pictures = stages.pixels[static_cast<int>(projection)];
  const auto keep_one = [&](Stage stage, std::uint32_t i, int value) {
    const int x = static_cast<int>(i) % input.width(), y = static_cast<int>(i) / input.width();
    if (x < x0 || y < y0 || x >= x1 || y >= y1) return;
    pictures[static_cast<int>(stage)].push_back(
        {x + offset_x, y + offset_y, static_cast<std::uint8_t>(value)});
  };
  for (const std::uint32_t i : input.touched()) keep_one(Stage::input, i, std::popcount(input.layers(i)));
  for (const std::uint32_t i : above_threshold.set()) keep_one(Stage::threshold, i, 64);
  for (const std::uint32_t i : filtered.set()) keep_one(Stage::filtered, i, 64);
  for (const std::uint32_t i : dilated.set()) keep_one(Stage::dilated, i, 64);
  for (const std::uint32_t i : skeleton.set()) keep_one(Stage::skeleton, i, 64);
}

}  // namespace parhelion::semantic
