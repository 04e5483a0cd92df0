// What of a surface each view sees, and how well.
#pragma once

#include <span>

#include "fusion/semantic/texture/quad_surface.hpp"
#include "fusion/semantic/texture/views.hpp"

namespace parhelion::semantic {

/// The depth of the surface in a view, and how far each pixel is from an edge of it.
struct ViewGeometry {
  Pinhole camera;
  Eigen::Isometry3d T_optical_map = Eigen::Isometry3d::Identity();
  std::vector<float> depth;  ///< m; 0: no surface, or it is hidden by what is no part of the site
  /// Pixels to the nearest edge of depth or of the image, at most kClear; 0 where no depth image confirms the
  /// surface.
  std::vector<std::uint8_t> clear;

  static constexpr int kClear = 24;
};

ViewGeometry geometry_of(const QuadSurface& surface, const ColourView& view);
std::vector<ViewGeometry> geometry_of(const QuadSurface& surface, std::span<const ColourView> views,
                                      int threads);

/// How well a view sees a point of the surface: 0: not at all, hidden, or from behind.
struct Sight {
  float weight = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};
Sight sight(const ViewGeometry& view, const Eigen::Vector3f& point, const Eigen::Vector3f& unit_normal);

}  // namespace parhelion::semantic
