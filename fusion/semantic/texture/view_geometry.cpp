#include "fusion/semantic/texture/view_geometry.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/texture/depth_raster.hpp"

namespace parhelion::semantic {
namespace {

constexpr float kStep = 0.06F;     ///< m and share of the depth: a step between pixels that is an edge
constexpr float kHidden = 0.03F;   ///< m and share of the depth: a point this far behind is hidden
constexpr float kGrazing = 0.15F;  ///< cosine of the steepest angle that is used
constexpr float kFewPixels = 3;    ///< as near to an edge nothing is trusted

/// Where depth steps, or surface ends.
std::vector<std::uint8_t> edges_of(const ViewGeometry& view) {
  std::vector<std::uint8_t> distance(view.depth.size(), ViewGeometry::kClear);
  const auto differs = [&](std::size_t a, std::size_t b) {
    const float da = view.depth[a], db = view.depth[b];
    return (da > 0) != (db > 0) || std::abs(da - db) > kStep * std::max(0.5F, std::min(da, db));
  };
  for (int row = 0; row < view.camera.height; ++row) {
    for (int column = 0; column < view.camera.width; ++column) {
      const std::size_t here = view.camera.at(column, row);
      const bool border =
          row == 0 || column == 0 || row + 1 == view.camera.height || column + 1 == view.camera.width;
      if (border) distance[here] = 0;
      if (column > 0 && differs(here, here - 1)) distance[here] = distance[here - 1] = 0;
      const std::size_t above = here - static_cast<std::size_t>(view.camera.width);
      if (row > 0 && differs(here, above)) distance[here] = distance[above] = 0;
    }
  }
  return distance;
}

/// City-block distance, in two passes.
void spread(const Pinhole& camera, std::vector<std::uint8_t>& distance) {
  const auto lower = [&](std::size_t here, std::size_t from) {
    distance[here] = std::min<std::uint8_t>(distance[here], static_cast<std::uint8_t>(distance[from] + 1));
  };
  const auto width = static_cast<std::size_t>(camera.width), size = distance.size();
  for (std::size_t i = 0; i < size; ++i) {
    if (i % width > 0) lower(i, i - 1);
    if (i >= width) lower(i, i - width);
  }
  for (std::size_t i = size; i-- > 0;) {
    if (i % width + 1 < width) lower(i, i + 1);
    if (i + width < size) lower(i, i + width);
  }
}

float ramp(float x, float from, float to) { return std::clamp((x - from) / (to - from), 0.F, 1.F); }

}  // namespace

ViewGeometry geometry_of(const QuadSurface& surface, const ColourView& view) {
  ViewGeometry geometry{view.camera, view.T_map_optical.inverse().isometry(), {}, {}};
  const auto pixels = see(surface, view.camera, view.T_map_optical);
  geometry.depth.resize(pixels.size());
  std::transform(pixels.begin(), pixels.end(), geometry.depth.begin(),
                 [](const SeenPixel& pixel) { return pixel.depth; });
  for (std::size_t i = 0; i < view.witnessed.size(); ++i)
    if (view.witnessed[i] == Witnessed::contradicts) geometry.depth[i] = 0;
  geometry.clear = edges_of(geometry);
  spread(view.camera, geometry.clear);
  for (std::size_t i = 0; i < view.witnessed.size(); ++i)
    if (view.witnessed[i] == Witnessed::unmeasured) geometry.clear[i] = 0;
  return geometry;
}

std::vector<ViewGeometry> geometry_of(const QuadSurface& surface, std::span<const ColourView> views,
                                      int threads) {
  std::vector<ViewGeometry> all(views.size());
  cloud::for_each_chunk(views.size(), 1, threads, [&](std::size_t i, std::size_t, std::size_t) {
    all[i] = geometry_of(surface, views[i]);
  });
  return all;
}

Sight sight(const ViewGeometry& view, const Eigen::Vector3f& point, const Eigen::Vector3f& unit_normal) {
  const Eigen::Vector3d p = view.T_optical_map * point.cast<double>();
  if (p.z() < 0.05) return {};
  const Eigen::Vector2d pixel = view.camera.project(p);
  if (!view.camera.contains(pixel, 1)) return {};
  const std::size_t at = view.camera.at(static_cast<int>(pixel.x() + 0.5), static_cast<int>(pixel.y() + 0.5));
  const auto z = static_cast<float>(p.z());
  if (view.depth[at] <= 0 || z > view.depth[at] + kHidden * std::max(1.F, z)) return {};
  const auto distance = static_cast<float>(p.norm());
  const float cosine =
      -static_cast<float>((view.T_optical_map.linear() * unit_normal.cast<double>()).dot(p)) / distance;
  if (cosine < kGrazing) return {};
  const float clear = ramp(static_cast<float>(view.clear[at]), kFewPixels, ViewGeometry::kClear);
  return {(cosine - kGrazing) * (0.02F + clear) / (distance * distance), pixel};
}

}  // namespace parhelion::semantic
