#include "fusion/pose/maps/known_space.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::pose {

KnownSpace::KnownSpace(const Eigen::Vector2d& low, const Eigen::Vector2d& high)
    : low_(low),
      width_(static_cast<std::ptrdiff_t>((high.x() - low.x()) / kCell) + 1),
      height_(static_cast<std::ptrdiff_t>((high.y() - low.y()) / kCell) + 1),
      known_(static_cast<std::size_t>(width_ * height_), false) {}

/// Negative: outside.
std::ptrdiff_t KnownSpace::index(const Eigen::Vector2d& p_map) const {
  const auto x = static_cast<std::ptrdiff_t>(std::floor((p_map.x() - low_.x()) / kCell)),
             y = static_cast<std::ptrdiff_t>(std::floor((p_map.y() - low_.y()) / kCell));
  return x < 0 || y < 0 || x >= width_ || y >= height_ ? -1 : y * width_ + x;
}

void KnownSpace::add(const Eigen::Vector2d& p_map) {
  if (const std::ptrdiff_t at = index(p_map); at >= 0) known_[static_cast<std::size_t>(at)] = true;
}

void KnownSpace::add_beam(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const double range = (to - from).norm();
  for (double s = 0; s < range; s += kCell) add(from + (to - from) * (s / range));
}

bool KnownSpace::contains(const Eigen::Vector2d& p_map) const {
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      const std::ptrdiff_t at = index(p_map + kCell * Eigen::Vector2d(i, j));
      if (at < 0 || !known_[static_cast<std::size_t>(at)]) return false;
    }
  }
  return true;
}

}  // namespace parhelion::pose
