#include "fusion/semantic/objects/object_shape.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "fusion/semantic/objects/plan_rectangle.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

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
  const PlanRectangle rectangle = plan_rectangle(plan, grid.cell());
  shape.middle = rectangle.middle, shape.yaw = rectangle.yaw;
  shape.length = rectangle.length, shape.width = rectangle.width;
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
