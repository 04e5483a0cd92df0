#include "fusion/semantic/texture/views.hpp"

#include <algorithm>

namespace parhelion::semantic {

Eigen::Vector3f colour_at(const ColourView& view, const Eigen::Vector2d& pixel) {
  const int column = std::clamp(static_cast<int>(pixel.x()), 0, std::max(0, view.camera.width - 2));
  const int row = std::clamp(static_cast<int>(pixel.y()), 0, std::max(0, view.camera.height - 2));
  const int right = std::min(column + 1, view.camera.width - 1);
  const int below = std::min(row + 1, view.camera.height - 1);
  const auto at = [&](int c, int r) {
    const std::uint8_t* p = &view.rgb[3 * view.camera.at(c, r)];
    return Eigen::Vector3f(p[0], p[1], p[2]);
  };
  const auto s = static_cast<float>(pixel.x() - column), t = static_cast<float>(pixel.y() - row);
  const Eigen::Vector3f top = at(column, row) + s * (at(right, row) - at(column, row));
  const Eigen::Vector3f bottom = at(column, below) + s * (at(right, below) - at(column, below));
  return top + t * (bottom - top);
}

}  // namespace parhelion::semantic
