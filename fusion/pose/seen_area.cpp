#include "fusion/pose/seen_area.hpp"

#include <cmath>

namespace parhelion::pose {

SeenArea::SeenArea(const Eigen::Vector2d& low, const Eigen::Vector2d& high)
    : low_(low),
      columns_(static_cast<int>((high.x() - low.x()) / kCell) + 1),
      rows_(static_cast<int>((high.y() - low.y()) / kCell) + 1),
      passed_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

void SeenArea::add_beam(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const int steps = static_cast<int>(std::ceil((to - from).norm() / kCell)) + 1;
  const Eigen::Vector2d start = (from - low_) / kCell, step = (to - from) / (kCell * steps);
  for (int i = 0; i <= steps; ++i) {
    const Eigen::Vector2d p = start + i * step;
    const int column = static_cast<int>(std::floor(p.x())), row = static_cast<int>(std::floor(p.y()));
    if (holds(column, row)) passed_[index(column, row)] = true;
  }
}

bool SeenArea::is_inside(const Eigen::Vector2d& p) const {
  const Eigen::Vector2d at = (p - low_) / kCell;
  const int column = static_cast<int>(std::floor(at.x())), row = static_cast<int>(std::floor(at.y()));
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      if (!holds(column + i, row + j) || !passed_[index(column + i, row + j)]) return false;
    }
  }
  return true;
}

}  // namespace parhelion::pose
