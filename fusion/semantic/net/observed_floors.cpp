#include "fusion/semantic/net/observed_floors.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "fusion/semantic/grid/cell_grid.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kSomePieces = 100;  ///< of one floor, plus one per kPerPiece; more are reduced by
constexpr double kPerPiece = 10;     ///< larger cells; m^2
constexpr double kMaxCells = 4e6;
constexpr double kMinPiece = 0.1;  ///< m^2; next to steps a tenth of it
constexpr double kMaxHole = 0.5;   ///< m^2, unobserved part of a piece
constexpr long kFreeCells = 8;     ///< of a piece that lie in steps or were looked through
constexpr double kHeadroom = 1.9;  ///< m, minimum height of a floor above a step
constexpr double kFlush = 0.05;    ///< m, height difference of a floor and a step at its edge
constexpr int kUnder = 4;          ///< cubes (0.4 m) below a floor: scans bend by less
constexpr int kFiner = 4;          ///< subdivision of a cell where a floor ends at steps

/// Whether the floor's surface at `p` or the air just over it was observed.
bool observed(const EvidenceGrid& evidence, const Eigen::Vector3d& p) {
  const double half = evidence.cube() / 2;
  return evidence.at(p - Eigen::Vector3d(0, 0, half)) != Evidence::unobserved ||
         evidence.at(p + Eigen::Vector3d(0, 0, half)) != Evidence::unobserved;
}

/// Whether a line of sight went through the floor's surface at `p`: beside a landing the air above it was
/// seen too.
bool seen_through(const EvidenceGrid& evidence, const Eigen::Vector3d& p) {
  const auto at = [&](int k) { return evidence.at(p - Eigen::Vector3d(0, 0, (k - 0.5) * evidence.cube())); };
  int through = 0;
  while (through < kUnder && at(through + 1) == Evidence::seen_through) ++through;
  return through == kUnder && at(0) != Evidence::measured;
}

/// Cells of the floor's box: occupied where most of their cubes were observed, free where most were looked
/// through.
CellGrid cells_of(const EvidenceGrid& evidence, const ModelEntity& floor, double cell) {
  CellGrid grid;
  grid.resolution = cell;
  grid.origin = -0.5 * floor.size.head<2>();  // in the floor's own frame
  grid.width = std::max(1, static_cast<int>(std::ceil(floor.size.x() / cell)));
  grid.height = std::max(1, static_cast<int>(std::ceil(floor.size.y() / cell)));
  grid.cells.assign(grid.index(0, grid.height), Cell::unknown);
  const int samples = std::max(1, static_cast<int>(std::lround(cell / evidence.cube())));
  tbb::parallel_for(0, grid.height, [&](int y) {
    for (int x = 0; x < grid.width; ++x) {
      int seen = 0, open = 0;
      for (int k = 0; k < samples * samples; ++k) {
        const Eigen::Vector2d in_cell = Eigen::Vector2d(k % samples + 0.5, k / samples + 0.5) / samples;
        const Eigen::Vector2d p = grid.origin + cell * (Eigen::Vector2d(x, y) + in_cell);
        const Eigen::Vector3d p_map = floor.T_map_body * Eigen::Vector3d(p.x(), p.y(), floor.size.z() / 2);
        seen += observed(evidence, p_map);
        open += seen_through(evidence, p_map);
      }
      Cell& result = grid.cells[grid.index(x, y)];
      if (2 * seen >= samples * samples) result = Cell::occupied;
      if (2 * open >= samples * samples) result = Cell::free;
    }
  });
  return grid;
}

/// Closes gaps of one cell between cells, caused by a scan's lines.
void close_gaps(CellGrid& grid) {
  CellGrid grown = grid;
  const auto any = [](const CellGrid& from, int x, int y, Cell cell) {
    for (int k = 0; k < 9; ++k) {
      if (from.contains(x + k % 3 - 1, y + k / 3 - 1) && from.at(x + k % 3 - 1, y + k / 3 - 1) == cell)
        return true;
    }
    return false;
  };
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      if (any(grid, x, y, Cell::occupied)) grown.cells[grown.index(x, y)] = Cell::occupied;
    }
  }
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      Cell& cell = grid.cells[grid.index(x, y)];
      if (cell == Cell::unknown && !any(grown, x, y, Cell::unknown) && !any(grown, x, y, Cell::free))
        cell = Cell::occupied;
    }
  }
}

/// Steps and ramps that exclude `floor`: flush with it, or below it without headroom.
std::vector<const ModelEntity*> steps_in(const ModelEntity& floor, const SemanticModel& model) {
  const auto top = [](const ModelEntity& e) { return e.T_map_body.translation().z() + e.size.z() / 2; };
  std::vector<const ModelEntity*> steps;
  for (const ModelEntity& e : model.entities) {
    if ((e.label != EntityLabel::stairs && e.label != EntityLabel::ramp) || !is_solid(e)) continue;
    const double over = top(e) - top(floor);
    const double reach = (e.size.head<2>().norm() + floor.size.head<2>().norm()) / 2;
    const double apart = (e.T_map_body.translation() - floor.T_map_body.translation()).head<2>().norm();
    if (over < kFlush && over > -kHeadroom && apart < reach) steps.push_back(&e);
  }
  return steps;
}

/// `p_map` in the plan of an entity, grown by `margin` on all sides.
bool in_plan_of(const ModelEntity& entity, const Eigen::Vector3d& p_map, double margin) {
  const Eigen::Vector3d p = entity.T_map_body.inverse() * p_map;
  return std::abs(p.x()) < entity.size.x() / 2 + margin && std::abs(p.y()) < entity.size.y() / 2 + margin;
}

CellGrid finer(const CellGrid& grid) {
  CellGrid fine = grid;
  fine.resolution = grid.resolution / kFiner;
  fine.width = kFiner * grid.width;
  fine.height = kFiner * grid.height;
  fine.cells.resize(fine.index(0, fine.height));
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) fine.cells[fine.index(x, y)] = grid.at(x / kFiner, y / kFiner);
  }
  return fine;
}

/// A floor's cells are coarse, and would overlap the steps that lead up to it, or flicker with the last of
/// them. Beside steps no gap is closed: floors end there.
void end_at_steps(const EvidenceGrid& evidence, const ModelEntity& floor,
                  const std::vector<const ModelEntity*>& steps, CellGrid& grid) {
  const double coarse = grid.resolution;
  if (16.0 * static_cast<double>(grid.cells.size()) < kMaxCells) grid = finer(grid);
  const auto place = [&](double x, double y) {
    const Eigen::Vector2d p = grid.origin + grid.resolution * Eigen::Vector2d(x, y);
    return Eigen::Vector3d(floor.T_map_body * Eigen::Vector3d(p.x(), p.y(), floor.size.z() / 2));
  };
  const auto in_step = [&](const Eigen::Vector3d& p, double margin) {
    return std::any_of(steps.begin(), steps.end(),
                       [&](const ModelEntity* step) { return in_plan_of(*step, p, margin); });
  };
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      const Eigen::Vector3d centre = place(x + 0.5, y + 0.5);
      Cell& cell = grid.cells[grid.index(x, y)];
      if (cell != Cell::occupied || !in_step(centre, coarse)) continue;
      bool covered = true;
      for (int k = 0; k < 4; ++k)
        covered = covered && in_step(place(x + 0.25 + 0.5 * (k % 2), y + 0.25 + 0.5 * (k / 2)), 0);
      if (covered) {
        cell = Cell::free;
      } else if (!observed(evidence, centre)) {
        cell = Cell::unknown;
      }
    }
  }
}

/// Box of an upright entity.
double fraction_of(const CellGrid& grid, const PlanBox& box) {
  const double c = std::abs(std::cos(box.yaw)), d = std::abs(std::sin(box.yaw));
  const Eigen::Vector2d half =
      0.5 * Eigen::Vector2d(c * box.length + d * box.thickness, d * box.length + c * box.thickness);
  const Eigen::Vector2d low = (box.centre - half).array().round(), high = (box.centre + half).array().round();
  double seen = 0, all = 0;
  for (int y = static_cast<int>(low.y()); y < static_cast<int>(high.y()); ++y) {
    for (int x = static_cast<int>(low.x()); x < static_cast<int>(high.x()); ++x) {
      ++all;
      seen += grid.at(x, y) == Cell::occupied ? 1 : 0;
    }
  }
  return all > 0 ? seen / all : 0;
}

std::vector<ModelEntity> pieces_of(const EvidenceGrid& evidence, const ModelEntity& floor,
                                   const std::vector<const ModelEntity*>& steps) {
  CellGrid grid;
  std::vector<PlanBox> boxes;
  const double min_area = steps.empty() ? kMinPiece : kMinPiece / 10;
  double cell = 2 * evidence.cube();
  while (floor.size.x() * floor.size.y() / (cell * cell) > kMaxCells) cell *= 2;
  for (;; cell *= 2) {
    grid = cells_of(evidence, floor, cell);
    close_gaps(grid);
    if (!steps.empty()) end_at_steps(evidence, floor, steps, grid);
    CellMask mask(grid.cells.size());
    std::transform(grid.cells.begin(), grid.cells.end(), mask.begin(),
                   [](Cell c) { return c == Cell::occupied ? std::uint8_t{1} : std::uint8_t{0}; });
    const CoverLimits limits{static_cast<long>(kMaxHole / std::pow(grid.resolution, 2)), kFreeCells};
    boxes = cover_with_blocks(grid, mask, limits);
    std::erase_if(boxes, [&](const PlanBox& b) {
      return b.length * b.thickness * std::pow(grid.resolution, 2) < min_area;
    });
    if (static_cast<double>(boxes.size()) <= kSomePieces + floor.size.x() * floor.size.y() / kPerPiece) break;
  }
  std::stable_sort(boxes.begin(), boxes.end(), [](const PlanBox& a, const PlanBox& b) {
    return a.length * a.thickness > b.length * b.thickness;
  });
  std::vector<ModelEntity> pieces;
  for (const PlanBox& box : boxes) {
    ModelEntity piece = floor;
    const Eigen::Vector2d centre = grid.origin + grid.resolution * box.centre;
    piece.T_map_body = floor.T_map_body * Transform<Body, Body>::planar(centre.x(), centre.y(), box.yaw, 0);
    piece.size = {grid.resolution * box.length, grid.resolution * box.thickness, floor.size.z()};
    piece.observed = fraction_of(grid, box);
    if (!pieces.empty()) {
      piece.name = floor.name + "." + std::to_string(pieces.size() + 1);
      piece.part_of = floor.name;
    }
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

}  // namespace

std::vector<HeightRange> heights_of_floors(const SemanticModel& model, double cube) {
  std::vector<HeightRange> heights;
  for (const ModelEntity& entity : model.entities) {
    if (entity.label != EntityLabel::floor) continue;
    const double top = entity.T_map_body.translation().z() + entity.size.z() / 2;
    // One cube more for rounding, and what a floor that counts as level may lean.
    const double margin = cube + 1e-4 * entity.size.norm();
    heights.push_back({top - kUnder * cube - margin, top + cube + margin});
  }
  // Nothing is asked for, which is not the same as no limit.
  if (heights.empty()) heights.push_back({0, -1});
  return heights;
}

void cut_floors(const EvidenceGrid& evidence, SemanticModel& model) {
  std::vector<ModelEntity> entities;
  std::set<std::string> gone;
  for (const ModelEntity& entity : model.entities) {
    const bool level = entity.T_map_body.rotation()(2, 2) > 1 - 1e-9;
    if (entity.label != EntityLabel::floor || !level || entity.is_virtual) {
      entities.push_back(entity);
      continue;
    }
    std::vector<ModelEntity> pieces = pieces_of(evidence, entity, steps_in(entity, model));
    if (pieces.empty()) gone.insert(entity.name);
    entities.insert(entities.end(), pieces.begin(), pieces.end());
  }
  model.entities = std::move(entities);
  std::erase_if(model.relations,
                [&](const Relation& r) { return gone.contains(r.from) || gone.contains(r.to); });
}

}  // namespace parhelion::semantic
