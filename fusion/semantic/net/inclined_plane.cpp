#include "fusion/semantic/net/inclined_plane.hpp"

#include <cmath>

#include "protocols/model.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kSquare = 0.5;  // m, of the plan

using Label = EntityLabel;
using Place = InclinedPlane::Place;

}  // namespace

Place InclinedPlane::cell_of(const Eigen::Vector3d& p) const {
  const Eigen::Vector2d cell = at(p) / kCell;
  return {static_cast<int>(std::floor(cell.x())), static_cast<int>(std::floor(cell.y()))};
}

bool InclinedPlane::contains(const Eigen::Vector3d& p) const {
  if (std::abs(off(p)) > kOn) return false;
  const auto [v, u] = cell_of(p);
  for (int n = 0; n < 9; ++n) {
    if (cells.contains({v + n % 3 - 1, u + n / 3 - 1})) return true;
  }
  return false;
}

PlanesByPlace::PlanesByPlace(const std::vector<InclinedPlane>& planes) {
  for (std::uint32_t r = 0; r < planes.size(); ++r) {
    for (const auto& [x, y] : planes[r].squares) {
      for (int n = 0; n < 9; ++n) {
        std::vector<std::uint32_t>& there = planes_[{x + n % 3 - 1, y + n / 3 - 1}];
        if (there.empty() || there.back() != r) there.push_back(r);
      }
    }
  }
}

Place PlanesByPlace::square_of(const Eigen::Vector3d& p) {
  return {static_cast<int>(std::floor(p.x() / kSquare)), static_cast<int>(std::floor(p.y() / kSquare))};
}

std::span<const std::uint32_t> PlanesByPlace::over(const Place& square) const {
  const auto found = planes_.find(square);
  return found == planes_.end() ? std::span<const std::uint32_t>() : std::span(found->second);
}

bool may_be_ceiling(std::uint8_t label) {
  return label == static_cast<std::uint8_t>(Label::unknown) ||
         label == static_cast<std::uint8_t>(Label::ceiling);
}

}  // namespace parhelion::semantic
