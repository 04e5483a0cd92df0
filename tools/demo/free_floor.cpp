#include "tools/demo/free_floor.hpp"

#include <cmath>

namespace parhelion::tools {

bool is_free(const pose::GridMap& map, const Eigen::Vector2d& at, double radius) {
  const auto cell = [&](double value, double low) {
    return static_cast<int>(std::floor((value - low) / map.resolution));
  };
  for (int y = cell(at.y() - radius, map.y_min); y <= cell(at.y() + radius, map.y_min); ++y) {
    for (int x = cell(at.x() - radius, map.x_min); x <= cell(at.x() + radius, map.x_min); ++x) {
      if (x < 0 || y < 0 || x >= map.width || y >= map.height) return false;
      if (map.occupied[static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) +
                       static_cast<std::size_t>(x)] > 0.4F) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace parhelion::tools
