#include "fusion/semantic/objects/object_shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

/// The rectangle of least area around most of the plan.
void fit_rectangle(const std::vector<Eigen::Vector2d>& plan, double cell, ObjectShape& shape) {
  constexpr int kTurns = 30;
  double best = std::numeric_limits<double>::max();
  std::vector<double> s(plan.size()), t(plan.size());
  for (int k = 0; k < kTurns; ++k) {
    const double yaw = 0.5 * EIGEN_PI * k / kTurns;
    const Eigen::Vector2d along(std::cos(yaw), std::sin(yaw)), across(-along.y(), along.x());
    for (std::size_t i = 0; i < plan.size(); ++i) s[i] = along.dot(plan[i]), t[i] = across.dot(plan[i]);
    const double s0 = quantile(s, 0.01), s1 = quantile(s, 0.99), t0 = quantile(t, 0.01),
                 t1 = quantile(t, 0.99);
    const double area = (s1 - s0 + cell) * (t1 - t0 + cell);
    if (area > 0.995 * best) continue;
    best = area;
    shape.middle = 0.5 * (s0 + s1) * along + 0.5 * (t0 + t1) * across;
    shape.length = s1 - s0 + cell, shape.width = t1 - t0 + cell, shape.yaw = yaw;
  }
  if (shape.width <= shape.length) return;
  std::swap(shape.width, shape.length);
  shape.yaw -= 0.5 * EIGEN_PI;
}

/// Fraction of the upright faces, looked at along the box's longer and its shorter side, that cubes fill.
double filled_fraction(const ObjectGrid& grid, const ObjectGroup& group, const ObjectShape& shape) {
  const Eigen::Vector2d along(std::cos(shape.yaw), std::sin(shape.yaw));
  std::set<std::pair<int, int>> seen;
  for (const std::uint32_t c : group.cubes)
    seen.emplace(static_cast<int>(std::floor(along.dot(grid.plan(c)) / grid.cell())), grid.cubes()[c].at.z());
  const double high = std::max(grid.cell(), shape.top - shape.bottom);
  return std::min(1.0, static_cast<double>(seen.size()) * grid.cell() * grid.cell() / (shape.length * high));
}

}  // namespace

ObjectShape shape_of(const ObjectGrid& grid, const ObjectGroup& group,
                     const std::vector<ObjectPlate>& plates) {
  ObjectShape shape;
  shape.table = group.table;
  shape.cubes = group.cubes.size();
  std::vector<Eigen::Vector2d> plan;
  std::vector<double> heights, floors;
  for (const std::uint32_t c : group.cubes) {
    if (plan.empty() || plan.back() != grid.plan(c)) plan.push_back(grid.plan(c));
    heights.push_back(grid.height(c)), floors.push_back(grid.floor(c));
  }
  fit_rectangle(plan, grid.cell(), shape);
  shape.floor = quantile(floors, 0.5);
  shape.bottom = std::max(0.0, quantile(heights, 0.01) - 0.5 * grid.cell());
  if (shape.bottom < 0.12) shape.bottom = 0;
  shape.top = quantile(heights, 0.99) + 0.25 * grid.cell();
  for (const ObjectPlate& plate : plates) {
    const bool inside =
        std::binary_search(group.cubes.begin(), group.cubes.end(), plate.cubes[plate.cubes.size() / 2]);
    if (!inside) continue;
    shape.plates += plate.area;
    if (plate.area > shape.plate_area)
      shape.plate_area = plate.area, shape.plate = plate.height, shape.sides = plate.sides;
  }
  shape.filled = filled_fraction(grid, group, shape);
  return shape;
}

}  // namespace parhelion::semantic
