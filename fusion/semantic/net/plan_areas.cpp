#include "fusion/semantic/net/plan_areas.hpp"

#include <cmath>

namespace parhelion::semantic {

std::uint64_t PlanAreas::key(const Eigen::Vector2d& cell) {
  const auto number = [](double v) { return static_cast<std::uint32_t>(static_cast<std::int64_t>(v)); };
  return static_cast<std::uint64_t>(number(cell.x())) << 32 | number(cell.y());
}

void PlanAreas::add(const Eigen::Vector2d& centre, const Eigen::Vector2d& along,
                    const Eigen::Vector2d& half) {
  const Eigen::Vector2d across(-along.y(), along.x());
  const Eigen::Vector2d box = along.cwiseAbs() * half.x() + across.cwiseAbs() * half.y();
  const Eigen::Vector2d first = ((centre - box) / kCell).array().floor(),
                        last = ((centre + box) / kCell).array().floor();
  const Eigen::Vector2d reach = half.array() + kCell * M_SQRT1_2;
  for (double y = first.y(); y <= last.y(); ++y) {
    for (double x = first.x(); x <= last.x(); ++x) {
      const Eigen::Vector2d from = kCell * Eigen::Vector2d(x + 0.5, y + 0.5) - centre;
      if (std::abs(along.dot(from)) <= reach.x() && std::abs(across.dot(from)) <= reach.y())
        cells_[key({x, y})].push_back(size_);
    }
  }
  ++size_;
}

std::span<const std::uint32_t> PlanAreas::near(const Eigen::Vector2d& p) const {
  constexpr double farthest = 1e9;  // m: a cell number still fits
  if (!(p.cwiseAbs().maxCoeff() < farthest)) return {};
  const auto found = cells_.find(key((p / kCell).array().floor()));
  if (found == cells_.end()) return {};
  return found->second;
}

}  // namespace parhelion::semantic
