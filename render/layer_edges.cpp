// Anti-aliased edges for layers that were drawn with one sample per pixel.
#include <cstdlib>

#include "render/layer_renderer.hpp"

namespace parhelion::render {
namespace {

/// Of 255: a smaller step between neighbours is shading, not an edge.
constexpr int kStep = 28;

bool differ(const std::uint8_t* a, const std::uint8_t* b, std::uint32_t id_a, std::uint32_t id_b) {
  if (((id_a ^ id_b) & 1023U) != 0) return true;
  return std::abs(a[0] - b[0]) > kStep || std::abs(a[1] - b[1]) > kStep || std::abs(a[2] - b[2]) > kStep;
}

}  // namespace

void smooth_edges(Layer& layer, bool everywhere) {
  const int width = layer.rect.width(), height = layer.rect.height();
  if (width < 3 || height < 3) return;
  static thread_local std::vector<std::uint8_t> edge;
  static thread_local std::vector<std::uint8_t> before;
  const auto stride = static_cast<std::size_t>(width);
  edge.assign(stride * static_cast<std::size_t>(height), 0);
  const auto mark = [&](std::size_t i, std::size_t j) {
    if (differ(&layer.rgba[4 * i], &layer.rgba[4 * j], layer.depth_id[i], layer.depth_id[j]))
      edge[i] = edge[j] = 1;
  };
  for (std::size_t y = 0; y + 1 < static_cast<std::size_t>(height); ++y) {
    for (std::size_t x = 0; x + 1 < stride; ++x) {
      const std::size_t i = y * stride + x;
      if (!everywhere && !layer.depth_id[i] && !layer.depth_id[i + 1] && !layer.depth_id[i + stride])
        continue;
      mark(i, i + 1);
      mark(i, i + stride);
    }
  }
  before = layer.rgba;
  for (std::size_t y = 1; y + 1 < static_cast<std::size_t>(height); ++y) {
    for (std::size_t x = 1; x + 1 < stride; ++x) {
      const std::size_t i = y * stride + x;
      if (!edge[i]) continue;
      for (std::size_t c = 0; c < 4; ++c) {
        const std::uint8_t* p = &before[4 * i + c];
        const std::size_t row = 4 * stride;
        const unsigned sum = 4U * p[0] + 2U * (p[-4] + p[4] + *(p - row) + p[row]) + *(p - row - 4) +
                             *(p - row + 4) + p[row - 4] + p[row + 4];
        layer.rgba[4 * i + c] = static_cast<std::uint8_t>((sum + 8) / 16);
      }
    }
  }
}

}  // namespace parhelion::render
