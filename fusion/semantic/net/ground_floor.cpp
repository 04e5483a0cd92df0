#include <algorithm>
#include <map>
#include <string>

#include "fusion/semantic/build_model.hpp"

namespace parhelion::semantic {

std::optional<double> ground_floor(const SemanticModel& model) {
  struct Floor {
    double area = 0, top = 0;
  };
  std::map<std::string, Floor> floors;  // a floor may consist of pieces
  for (const ModelEntity& entity : model.entities) {
    if (entity.label != EntityLabel::floor || !is_solid(entity)) continue;
    const double top = entity.T_map_body.translation().z() + entity.size.z() / 2;
    Floor& floor = floors[entity.part_of.empty() ? entity.name : entity.part_of];
    floor.top = floor.area > 0 ? std::min(floor.top, top) : top;
    floor.area += entity.size.x() * entity.size.y();
  }
  double largest = 0;
  for (const auto& [name, floor] : floors) largest = std::max(largest, floor.area);
  std::optional<double> height;
  for (const auto& [name, floor] : floors) {
    if (floor.area >= largest / 2) height = height ? std::min(*height, floor.top) : floor.top;
  }
  return height;
}

bool is_level(const ModelEntity& entity) { return entity.T_map_body.rotation()(2, 2) > 0.9999; }

std::optional<double> largest_ceiling(const SemanticModel& model) {
  const ModelEntity* largest = nullptr;
  for (const ModelEntity& e : model.entities) {
    if (e.label != EntityLabel::ceiling || e.deleted || !is_level(e)) continue;
    if (largest == nullptr || e.size.x() * e.size.y() > largest->size.x() * largest->size.y()) largest = &e;
  }
  if (largest == nullptr) return std::nullopt;
  return largest->T_map_body.translation().z() - largest->size.z() / 2;
}

}  // namespace parhelion::semantic
