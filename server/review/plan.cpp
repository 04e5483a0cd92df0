#include "server/review/plan.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace parhelion::review {
namespace {

bool shown(const ModelEntity& entity) {
  return !entity.deleted && entity.label != EntityLabel::ceiling &&
         entity.label != EntityLabel::wall_above_door && entity.label != EntityLabel::free_space;
}

PlanPart part_of(const ModelEntity& entity) {
  PlanPart part{entity.name, entity.label, {}};
  const Eigen::Vector3d half = entity.size / 2;
  const std::array<Eigen::Vector2d, 4> signs{Eigen::Vector2d{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (std::size_t i = 0; i < 4; ++i)
    part.corners[i] =
        (entity.T_map_body * Eigen::Vector3d(signs[i].x() * half.x(), signs[i].y() * half.y(), 0)).head<2>();
  return part;
}

std::vector<PlanRow> rows_of(const std::vector<ModelMesh>& meshes) {
  std::vector<std::pair<long, long>> cells;  // row, column
  for (const ModelMesh& mesh : meshes) {
    for (const Eigen::Vector3f& p : mesh.vertices) {
      if (p.z() < 0.05F || p.z() > 2.0F) continue;
      cells.emplace_back(std::lround(std::floor(p.y() / kPlanCell)),
                         std::lround(std::floor(p.x() / kPlanCell)));
    }
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  std::vector<PlanRow> rows;
  long last_row = 0, last_column = 0;
  for (const auto& [row, column] : cells) {
    if (rows.empty() || row != last_row || column > last_column + 1)
      rows.push_back(
          {(static_cast<double>(row) + 0.5) * kPlanCell, static_cast<double>(column) * kPlanCell, 0});
    rows.back().right = static_cast<double>(column + 1) * kPlanCell;
    last_row = row;
    last_column = column;
  }
  return rows;
}

}  // namespace

Plan plan_of(const SemanticModel& model) {
  Plan plan;
  for (const ModelEntity& entity : model.entities)
    if (shown(entity)) plan.parts.push_back(part_of(entity));
  std::stable_partition(plan.parts.begin(), plan.parts.end(),
                        [](const PlanPart& part) { return is_ground(part.label); });
  plan.rows = rows_of(model.meshes);
  return plan;
}

}  // namespace parhelion::review
