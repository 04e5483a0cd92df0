#include "fusion/pose/maps/seen_area.hpp"

#include <cmath>

namespace parhelion::pose {

SeenArea::SeenArea(const Eigen::Vector2d& centre, double reach)
    : low_(centre - Eigen::Vector2d(reach, reach)),
      side_(static_cast<std::size_t>(std::ceil(2 * reach / kCell))),
      passed_(side_ * side_) {}

std::optional<std::size_t> SeenArea::index(double x, double y) const {
  const auto side = static_cast<double>(side_);
  if (!(x >= 0 && y >= 0 && x < side && y < side)) return std::nullopt;
  return static_cast<std::size_t>(y) * side_ + static_cast<std::size_t>(x);
}

void SeenArea::add_beam(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const Eigen::Vector2d start = (from - low_) / kCell, along = (to - from) / kCell;
  // No beam crosses more of the square than its diagonal, wherever it ends.
  const double length = along.norm(), longest = 2 * static_cast<double>(side_);
  const int steps = static_cast<int>(std::ceil(std::min(length, longest))) + 1;
  const Eigen::Vector2d step = along * (std::min(1.0, longest / length) / steps);
  for (int i = 0; i <= steps; ++i) {
    const Eigen::Vector2d p = start + i * step;
    if (const auto cell = index(p.x(), p.y())) passed_[*cell] = true;
  }
}

bool SeenArea::is_inside(const Eigen::Vector2d& p) const {
  const Eigen::Vector2d at = (p - low_) / kCell;
  for (const double y : {-1.0, 0.0, 1.0}) {
    for (const double x : {-1.0, 0.0, 1.0}) {
      const auto cell = index(at.x() + x, at.y() + y);
      if (!cell || !passed_[*cell]) return false;
    }
  }
  return true;
}

}  // namespace parhelion::pose
