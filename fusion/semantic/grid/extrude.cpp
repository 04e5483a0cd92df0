#include "fusion/semantic/grid/extrude.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "fusion/semantic/grid/cell_grid.hpp"
#include "protocols/model_overlap.hpp"

namespace parhelion::semantic {
namespace {

constexpr int kSolidSide = 8;  ///< cells: minimum width in both directions of a block, instead of a wall
constexpr double kMaxCells = 4e8;

Status check(const pose::GridMap& map, const ExtrudeOptions& options) {
  const double cells = static_cast<double>(map.width) * map.height;
  if (map.width <= 0 || map.height <= 0 || cells > kMaxCells ||
      static_cast<double>(map.occupied.size()) != cells) {
    return Error{"the grid map has " + std::to_string(map.occupied.size()) +
                 " cells, expected width x height = " + std::to_string(map.width) + " x " +
                 std::to_string(map.height) + ", at most 4e8"};
  }
  if (!(map.resolution > 0) || !std::isfinite(map.resolution + map.x_min + map.y_min)) {
    return Error{
        "the grid map's resolution and origin: expected finite numbers and resolution > 0 m, found " +
        std::to_string(map.resolution) + " m"};
  }
  if (!(options.height > 0 && options.height <= 100)) {
    return Error{"wall height: expected 0 m < height <= 100 m, found " + std::to_string(options.height) +
                 " m"};
  }
  if (options.min_support < 1 || !(options.clear_radius >= 0) || !(options.reach >= 0) ||
      !std::isfinite(options.clear_radius + options.reach)) {
    return Error{"expected min_support >= 1, clear_radius >= 0 m and reach >= 0 m"};
  }
  if (!(options.free_below < options.occupied_above) || !(options.slab_thickness > 0) ||
      !(options.min_wall_length > 0)) {
    return Error{"expected free_below < occupied_above, slab_thickness > 0 m and min_wall_length > 0 m"};
  }
  return {};
}

CellGrid cut_into_cells(const pose::GridMap& map, const ExtrudeOptions& options) {
  CellGrid grid;
  grid.width = map.width;
  grid.height = map.height;
  grid.resolution = map.resolution;
  grid.origin = {map.x_min, map.y_min};
  grid.cells.reserve(map.occupied.size());
  for (const float p : map.occupied) {
    const bool solid = static_cast<double>(p) >= options.occupied_above;
    grid.cells.push_back(solid                                          ? Cell::occupied
                         : static_cast<double>(p) <= options.free_below ? Cell::free
                                                                        : Cell::unknown);
  }
  return grid;
}

CellMask occupied_mask(const CellGrid& grid) {
  CellMask mask(grid.cells.size());
  std::transform(grid.cells.begin(), grid.cells.end(), mask.begin(),
                 [](Cell cell) { return static_cast<std::uint8_t>(cell == Cell::occupied); });
  return mask;
}

/// Rounds to micrometres, to keep floating-point digits out of the file.
double tidy(double metres) { return std::round(metres * 1e6) / 1e6; }

ModelEntity upright_box(const CellGrid& grid, const PlanBox& box, double bottom, double top) {
  ModelEntity entity;
  const Eigen::Vector2d p = grid.origin + box.centre * grid.resolution;
  entity.T_map_body =
      Transform<Map, Body>::planar(tidy(p.x()), tidy(p.y()), box.yaw, tidy((bottom + top) / 2));
  entity.size = {tidy(box.length * grid.resolution), tidy(box.thickness * grid.resolution),
                 tidy(top - bottom)};
  return entity;
}

/// Fraction of the box's length along which the map has "wall" and not "free".
double confidence(const CellGrid& grid, const PlanBox& box) {
  int wall = 0, open = 0;
  const Eigen::Vector2d along(std::cos(box.yaw), std::sin(box.yaw));
  const Eigen::Vector2d across(-along.y(), along.x());
  for (double t = -box.length / 2; t <= box.length / 2; t += 0.5) {
    bool hit = false, all_free = true;
    for (double d = -box.thickness / 2; d <= box.thickness / 2; d += 0.5) {
      const Eigen::Vector2d p = box.centre + t * along + d * across;
      const Cell cell = grid.at(static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y())));
      hit = hit || cell == Cell::occupied;
      all_free = all_free && cell == Cell::free;
    }
    wall += hit ? 1 : 0;
    open += !hit && all_free ? 1 : 0;
  }
  return wall + open == 0 ? 0 : std::round(1000.0 * wall / (wall + open)) / 1000;
}

/// Drops walls that mostly lie in another one; their cells return to `left`.
std::vector<ModelEntity> walls_of(const CellGrid& grid, const ExtrudeOptions& options, CellMask& left) {
  std::vector<ModelEntity> walls;
  std::vector<PlanBox> kept;
  const CellMask before = left;
  for (const PlanBox& box :
       find_walls(grid, std::max(4.0, options.min_wall_length / grid.resolution), left)) {
    ModelEntity wall = upright_box(grid, box, 0, options.height);
    wall.label = EntityLabel::wall;
    const bool doubled = std::any_of(walls.begin(), walls.end(), [&](const ModelEntity& other) {
      return overlap_fraction(wall, other) > 0.5;
    });
    if (doubled) continue;
    wall.name = "wall " + std::to_string(walls.size() + 1);
    wall.confidence = confidence(grid, box);
    walls.push_back(std::move(wall));
    kept.push_back(box);
  }
  for (std::size_t i = 0; i < left.size(); ++i) {
    if (before[i] == 0 || left[i] != 0) continue;
    const Eigen::Vector2d p = grid.centre(i);
    left[i] =
        std::any_of(kept.begin(), kept.end(), [&](const PlanBox& box) { return box.covers(p); }) ? 0 : 1;
  }
  return walls;
}

/// Bounds of all cells that are not unknown.
PlanBox known_area(const CellGrid& grid) {
  Eigen::AlignedBox2d area;
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    if (grid.cells[i] != Cell::unknown) area.extend(grid.centre(i));
  }
  PlanBox box;
  box.centre = area.center();
  box.length = area.sizes().x() + 1;
  box.thickness = area.sizes().y() + 1;
  return box;
}

ModelEntity slab(const CellGrid& grid, EntityLabel label, double bottom, double top) {
  ModelEntity entity = upright_box(grid, known_area(grid), bottom, top);
  entity.label = label;
  entity.name = to_string(label);
  return entity;
}

}  // namespace

Result<SemanticModel> extrude(const pose::GridMap& map, const ExtrudeOptions& options) {
  if (const Status status = check(map, options); !status) return status.error();
  const CellGrid grid = cut_into_cells(map, options);
  CellMask left = occupied_mask(grid);
  if (std::find(left.begin(), left.end(), 1) == left.end()) {
    return Error{"the grid map has no occupied cell (probability >= " +
                 std::to_string(options.occupied_above) + "): there is no wall to extrude"};
  }
  // Blocks first: lines through a solid block would cut it at odd angles.
  const CellMask solid = solid_areas(grid, left, kSolidSide);
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = left[i] != 0 && solid[i] == 0 ? 1 : 0;

  SemanticModel model;
  model.map_id = map.id;
  model.source = "extruded from a grid map of " + std::to_string(map.width) + " x " +
                 std::to_string(map.height) + " cells";
  model.entities = walls_of(grid, options, left);
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = left[i] != 0 || solid[i] != 0 ? 1 : 0;
  left = supported_or_in_reach(grid, left, options.min_support, options.clear_radius / grid.resolution,
                               options.reach / grid.resolution);
  std::size_t unknown = 0;
  for (const PlanBox& box : cover_with_blocks(grid, left)) {
    ModelEntity entity = upright_box(grid, box, 0, options.height);
    entity.name = "unknown " + std::to_string(++unknown);
    entity.confidence = confidence(grid, box);
    model.entities.push_back(std::move(entity));
  }
  if (options.floor) model.entities.push_back(slab(grid, EntityLabel::floor, -options.slab_thickness, 0));
  if (options.ceiling) {
    model.entities.push_back(
        slab(grid, EntityLabel::ceiling, options.height, options.height + options.slab_thickness));
  }
  return model;
}

ExtrusionFigures measure_extrusion(const pose::GridMap& map, const SemanticModel& model,
                                   const ExtrudeOptions& options) {
  const CellGrid grid = cut_into_cells(map, options);
  ExtrusionFigures figures;
  CellMask covered(grid.cells.size(), 0);
  for (const ModelEntity& entity : model.entities) {
    if (entity.label == EntityLabel::floor || entity.label == EntityLabel::ceiling) continue;
    (entity.label == EntityLabel::wall ? figures.walls : figures.unknown) += 1;
    const PlanBox box{(entity.T_map_body.translation().head<2>() - grid.origin) / grid.resolution,
                      entity.T_map_body.yaw(), entity.size.x() / grid.resolution,
                      entity.size.y() / grid.resolution};
    constexpr int parts = 4;  // points per cell and direction
    int points = 0, open = 0;
    const double reach = std::hypot(box.length, box.thickness) / 2 + 1;
    for (double y = std::floor(box.centre.y() - reach); y <= box.centre.y() + reach; ++y) {
      for (double x = std::floor(box.centre.x() - reach); x <= box.centre.x() + reach; ++x) {
        const bool known = grid.contains(static_cast<int>(x), static_cast<int>(y));
        if (known && box.covers({x + 0.5, y + 0.5}))
          covered[grid.index(static_cast<int>(x), static_cast<int>(y))] = 1;
        const bool is_free = grid.at(static_cast<int>(x), static_cast<int>(y)) == Cell::free;
        for (int k = 0; k < parts * parts; ++k) {
          const int i = k % parts, j = k / parts;
          if (!box.covers({x + (i + 0.5) / parts, y + (j + 0.5) / parts})) continue;
          ++points;
          open += is_free ? 1 : 0;
        }
      }
    }
    const double area = entity.size.x() * entity.size.y();
    figures.box_area += area;
    figures.box_area_over_free += points > 0 ? area * open / points : 0;
  }
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    if (grid.cells[i] != Cell::occupied) continue;
    ++figures.occupied_cells;
    figures.covered_cells += covered[i];
  }
  return figures;
}

}  // namespace parhelion::semantic
