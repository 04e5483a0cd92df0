// Images with poses from which a site is textured. Pinhole only: who reads them takes the lens out.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/time.hpp"

namespace parhelion::semantic {

/// Pinhole camera, pixels; pixel centres at integer coordinates.
struct Pinhole {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;

  /// Pixel of a point in the optical frame with z > 0.
  Eigen::Vector2d project(const Eigen::Vector3d& p_optical) const {
    return {fx * p_optical.x() / p_optical.z() + cx, fy * p_optical.y() / p_optical.z() + cy};
  }
  bool contains(const Eigen::Vector2d& pixel, double margin = 0) const {
    return pixel.x() >= margin && pixel.y() >= margin && pixel.x() <= width - 1 - margin &&
           pixel.y() <= height - 1 - margin;
  }
  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
  }
};

/// What the depth image of the same instant says of a pixel that should show the site's surface.
enum class Witnessed : std::uint8_t {
  agrees,
  unmeasured,   ///< nothing was measured where others measured: somebody may have stood too near
  contradicts,  ///< something else stands there, or the surface was seen through
};

/// A colour image.
struct ColourView {
  Pinhole camera;
  Transform<Map, CameraOptical> T_map_optical;
  std::vector<std::uint8_t> rgb;                   ///< sRGB, row by row
  std::optional<SensorTime> stamp = std::nullopt;  ///< middle of the exposure
  std::vector<Witnessed> witnessed = {};           ///< of each pixel; empty: all agree
};

/// A depth image.
struct DepthView {
  Pinhole camera;
  Transform<Map, DepthOptical> T_map_optical;
  std::vector<std::uint16_t> millimetres;  ///< along the optical axis, row by row; 0: no measurement
  std::optional<SensorTime> stamp = std::nullopt;
};

/// Colour between pixels (bilinear), 0..255; the pixel must be contained.
Eigen::Vector3f colour_at(const ColourView& view, const Eigen::Vector2d& pixel);

}  // namespace parhelion::semantic
