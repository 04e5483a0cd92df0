#include "fusion/semantic/texture/depth_raster.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::semantic {
namespace {

constexpr float kNear = 0.05F;  ///< m

struct Corner {
  Eigen::Vector2f pixel;
  float inverse_depth;
  Eigen::Vector2f st;
};

float cross(const Eigen::Vector2f& a, const Eigen::Vector2f& b) { return a.x() * b.y() - a.y() * b.x(); }

void draw(const std::array<Corner, 3>& corners, std::uint32_t quad, const Pinhole& camera,
          std::vector<SeenPixel>& pixels) {
  const auto& [a, b, c] = corners;
  const float area = cross(b.pixel - a.pixel, c.pixel - a.pixel);
  if (std::abs(area) < 1e-6F) return;
  const Eigen::Vector2f low = a.pixel.cwiseMin(b.pixel).cwiseMin(c.pixel);
  const Eigen::Vector2f high = a.pixel.cwiseMax(b.pixel).cwiseMax(c.pixel);
  const int x0 = static_cast<int>(std::ceil(std::max(0.F, low.x())));
  const int y0 = static_cast<int>(std::ceil(std::max(0.F, low.y())));
  const int x1 = static_cast<int>(std::min(static_cast<float>(camera.width - 1), high.x()));
  const int y1 = static_cast<int>(std::min(static_cast<float>(camera.height - 1), high.y()));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const Eigen::Vector2f p(static_cast<float>(x), static_cast<float>(y));
      const float wa = cross(b.pixel - p, c.pixel - p) / area, wb = cross(c.pixel - p, a.pixel - p) / area;
      const float wc = 1 - wa - wb;
      if (std::min({wa, wb, wc}) < -1e-5F) continue;
      const float inverse = wa * a.inverse_depth + wb * b.inverse_depth + wc * c.inverse_depth;
      SeenPixel& pixel = pixels[camera.at(x, y)];
      if (pixel.depth > 0 && 1 / inverse >= pixel.depth) continue;
      const Eigen::Vector2f st =
          (wa * a.inverse_depth * a.st + wb * b.inverse_depth * b.st + wc * c.inverse_depth * c.st) / inverse;
      pixel = {1 / inverse, quad, st.x(), st.y()};
    }
  }
}

}  // namespace

std::vector<SeenPixel> see(const QuadSurface& surface, const Pinhole& camera,
                           const Transform<Map, CameraOptical>& T_map_optical) {
  const Eigen::Isometry3f T_optical_map = T_map_optical.inverse().isometry().cast<float>();
  std::vector<Eigen::Vector3f> projected(surface.vertices.size());  // pixel, 1 / depth; 0: behind
  for (std::size_t i = 0; i < projected.size(); ++i) {
    const Eigen::Vector3f p = T_optical_map * surface.vertices[i];
    projected[i].setZero();
    if (p.z() < kNear) continue;
    projected[i].head<2>() = camera.project(p.cast<double>()).cast<float>();
    projected[i].z() = 1 / p.z();
  }
  std::vector<SeenPixel> pixels(camera.pixels());
  const Eigen::Vector2f st[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (std::size_t q = 0; q < surface.quads.size(); ++q) {
    std::array<Corner, 4> corners;
    bool before = true;
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector3f& p = projected[surface.quads[q][i]];
      before = before && p.z() > 0;
      corners[i] = {p.head<2>(), p.z(), st[i]};
    }
    if (!before) continue;
    draw({corners[0], corners[1], corners[2]}, static_cast<std::uint32_t>(q), camera, pixels);
    draw({corners[0], corners[2], corners[3]}, static_cast<std::uint32_t>(q), camera, pixels);
  }
  return pixels;
}

}  // namespace parhelion::semantic
