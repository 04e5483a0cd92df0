#include "fusion/semantic/texture/lens_error.hpp"

#include <cmath>

namespace parhelion::semantic {
namespace {

constexpr double kVisible = 0.2;  ///< px at a corner; less is not worth the blur of a resampled image

}  // namespace

ColourView corrected(ColourView view, const LensError& error) {
  Pinhole& camera = view.camera;
  camera.fx *= error.focal, camera.fy *= error.focal;
  const auto off_at = [&](double x, double y) { return error.distortion * (x * x + y * y); };
  const double corner_x = camera.width / (2 * camera.fx), corner_y = camera.height / (2 * camera.fy);
  if (std::abs(off_at(corner_x, corner_y)) * std::hypot(camera.width, camera.height) / 2 < kVisible)
    return view;
  const ColourView recorded = view;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const double x = (column - camera.cx) / camera.fx, y = (row - camera.cy) / camera.fy;
      const Eigen::Vector2d pixel(column + camera.fx * x * off_at(x, y), row + camera.fy * y * off_at(x, y));
      const Eigen::Vector3f colour = colour_at(
          recorded, pixel.cwiseMax(0).cwiseMin(Eigen::Vector2d(camera.width - 1, camera.height - 1)));
      for (std::size_t c = 0; c < 3; ++c)
        view.rgb[3 * camera.at(column, row) + c] =
            static_cast<std::uint8_t>(std::lround(colour[static_cast<Eigen::Index>(c)]));
    }
  }
  return view;
}

}  // namespace parhelion::semantic
