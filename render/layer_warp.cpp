// Warps the pinhole views to the image of the lens.
#include <algorithm>

#include "render/layer_renderer.hpp"

namespace parhelion::render {

/// Bilinear for colour and coverage (premultiplied, so edges stay clean), nearest for depth and entity id.
void LayerRenderer::warp(const CameraProjection& projection, bool colour, Layer& layer) const {
  const std::size_t count =
      static_cast<std::size_t>(layer.rect.width()) * static_cast<std::size_t>(layer.rect.height());
  if (colour) layer.rgba.assign(4 * count, 0);
  layer.depth_id.assign(count, 0);
  std::size_t i = 0;
  for (int y = layer.rect.y0; y < layer.rect.y1; ++y) {
    for (int x = layer.rect.x0; x < layer.rect.x1; ++x, ++i) {
      const CameraProjection::Source& s = projection.source(x, y);
      if (s.view == CameraProjection::kNoView) continue;
      const ViewPixels& view = view_pixels_[s.view];
      const PixelRect& r = view.rect;
      const int u = static_cast<int>(s.u), v = static_cast<int>(s.v);
      if (u < r.x0 || v < r.y0 || u + 1 >= r.x1 || v + 1 >= r.y1) continue;
      const std::size_t stride = static_cast<std::size_t>(r.width());
      const std::size_t corner =
          static_cast<std::size_t>(v - r.y0) * stride + static_cast<std::size_t>(u - r.x0);
      const float a = s.u - static_cast<float>(u), b = s.v - static_cast<float>(v);
      std::uint32_t z = view.depth_id[corner + (a >= 0.5F ? 1 : 0) + (b >= 0.5F ? stride : 0)];
      // From the view's own axis to the camera's: their z differ on the side faces of a cube.
      if (z && projection.views().size() > 1) {
        const PinholeView& p = projection.views()[s.view];
        const double scale =
            (p.R_optical_view.row(2) * Eigen::Vector3d((static_cast<double>(s.u) - p.cx) / p.fx,
                                                       (static_cast<double>(s.v) - p.cy) / p.fy, 1))
                .value();
        const double quarter = std::clamp((z >> 10) * scale, 1.0, 4194303.0);
        z = (static_cast<std::uint32_t>(quarter) << 10) | (z & 1023U);
      }
      layer.depth_id[i] = z;
      if (!colour) continue;
      const std::uint8_t* p = &view.rgba[4 * corner];
      const float w00 = (1 - a) * (1 - b), w10 = a * (1 - b), w01 = (1 - a) * b, w11 = a * b;
      for (std::size_t c = 0; c < 4; ++c)
        layer.rgba[4 * i + c] =
            static_cast<std::uint8_t>(static_cast<float>(p[c]) * w00 + static_cast<float>(p[4 + c]) * w10 +
                                      static_cast<float>(p[4 * stride + c]) * w01 +
                                      static_cast<float>(p[4 * stride + 4 + c]) * w11 + 0.5F);
    }
  }
}

}  // namespace parhelion::render
