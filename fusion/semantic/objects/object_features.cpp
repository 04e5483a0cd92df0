#include "fusion/semantic/objects/object_features.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kFar = 3;  // m
constexpr std::size_t kBands = 5;

/// A level slice of the thing.
struct Band {
  double filled = 0;             ///< of the plan of its box
  double length = 0, width = 0;  ///< of the box's
};

std::array<Band, kBands> bands_of(const ObjectGrid& grid, const ObjectGroup& group,
                                  const ObjectShape& shape) {
  const Eigen::Vector2d along(std::cos(shape.yaw), std::sin(shape.yaw)), across(-along.y(), along.x());
  struct Cells {
    std::set<std::pair<int, int>> plan;
    std::vector<double> s, t;
  };
  std::array<Cells, kBands> cells;
  const double high = std::max(grid.cell(), shape.top - shape.bottom);
  for (const std::uint32_t c : group.cubes) {
    const double at = (grid.height(c) - shape.bottom) / high * kBands;
    Cells& of_band = cells[static_cast<std::size_t>(std::clamp(at, 0.0, kBands - 1.0))];
    of_band.plan.emplace(grid.cubes()[c].at.x(), grid.cubes()[c].at.y());
    const Eigen::Vector2d p = grid.plan(c) - shape.middle;
    of_band.s.push_back(along.dot(p)), of_band.t.push_back(across.dot(p));
  }
  std::array<Band, kBands> bands;
  const double area = std::max(grid.cell() * grid.cell(), shape.length * shape.width);
  const auto extent = [&](std::vector<double>& v, double full) {
    if (v.empty()) return 0.0;
    const double low = quantile(v, 0.02);
    return std::min(1.0, (quantile(v, 0.98) - low + grid.cell()) / full);
  };
  for (std::size_t k = 0; k < kBands; ++k) {
    bands[k].filled =
        std::min(1.0, static_cast<double>(cells[k].plan.size()) * grid.cell() * grid.cell() / area);
    bands[k].length = extent(cells[k].s, shape.length);
    bands[k].width = extent(cells[k].t, shape.width);
  }
  return bands;
}

/// Where the thing is in the building.
struct Surroundings {
  double wall = kFar, stairs = kFar;  ///< m in the plan from its box, about
  double along_wall = 0;              ///< |cosine| between its longer side and the nearest wall
  double ceiling = kFar;              ///< m from its top
  double rim = kFar;                  ///< m in the plan from its middle to the nearest floor's edge
};

Surroundings surroundings_of(const ObjectShape& shape, const std::vector<ModelEntity>& entities) {
  Surroundings around;
  for (const ModelEntity& e : entities) {
    const Eigen::Vector3d p =
        e.T_map_body.inverse() * Eigen::Vector3d(shape.middle.x(), shape.middle.y(), shape.floor + shape.top);
    const Eigen::Vector2d outside = (p.head<2>().cwiseAbs() - 0.5 * e.size.head<2>());
    const double distance = outside.cwiseMax(0).norm();
    if (e.label == EntityLabel::wall && distance < around.wall) {
      around.wall = distance;
      const Eigen::Vector2d wall = (e.T_map_body.rotation() * Eigen::Vector3d::UnitX()).head<2>();
      around.along_wall = std::abs(wall.dot(Eigen::Vector2d(std::cos(shape.yaw), std::sin(shape.yaw))));
    }
    if (e.label == EntityLabel::stairs) around.stairs = std::min(around.stairs, distance);
    if (e.label == EntityLabel::ceiling && distance <= 0 && p.z() < 0.5)
      around.ceiling = std::min(around.ceiling, std::abs(p.z() + 0.5 * e.size.z()));
    if (is_ground(e.label) && distance <= 0) around.rim = std::min(around.rim, -outside.maxCoeff());
  }
  around.wall = std::max(0.0, around.wall - 0.5 * shape.width);
  return around;
}

}  // namespace

ObjectFeatures features_of(const ObjectGrid& grid, const ObjectGroup& group, const ObjectShape& shape,
                           const std::vector<ModelEntity>& entities) {
  const double cell = grid.cell(), high = std::max(cell, shape.top - shape.bottom);
  const auto cubes = static_cast<double>(group.cubes.size());
  const double volume = shape.length * shape.width * high;
  const double surface = 2 * (shape.length * shape.width + shape.length * high + shape.width * high);
  std::vector<double> heights;
  double mean = 0;
  for (const std::uint32_t c : group.cubes) {
    heights.push_back((grid.height(c) - shape.bottom) / high);
    mean += heights.back() / cubes;
  }
  double spread = 0;
  for (const double h : heights) spread += (h - mean) * (h - mean) / cubes;
  const Surroundings around = surroundings_of(shape, entities);
  ObjectFeatures features{};
  std::size_t next = 0;
  const auto add = [&](double value) { features[next++] = static_cast<float>(value); };
  for (const double value : {shape.length,
                             shape.width,
                             shape.bottom,
                             shape.top,
                             high,
                             shape.plate,
                             shape.plate_area,
                             shape.sides,
                             shape.plates,
                             shape.filled,
                             shape.table ? 1.0 : 0.0,
                             std::min(1.0, cubes * cell * cell * cell / volume),
                             std::min(2.0, cubes * cell * cell / surface),
                             mean,
                             std::sqrt(spread),
                             cell,
                             around.wall,
                             around.along_wall,
                             around.stairs,
                             around.ceiling,
                             around.rim,
                             std::log(volume)})
    add(value);
  const auto bands = bands_of(grid, group, shape);
  for (const Band& band : bands) add(band.filled);
  for (const std::size_t k : {0U, 2U, 4U}) add(bands[k].length), add(bands[k].width);
  add(shape.plate_area / (shape.length * shape.width));
  return features;
}

}  // namespace parhelion::semantic
