#include <algorithm>

#include "fusion/semantic/build_model.hpp"

namespace parhelion {

std::optional<double> ground_floor(const SemanticModel& model) {
  double largest = 0;
  const auto area = [](const ModelEntity& e) { return e.size.x() * e.size.y(); };
  for (const ModelEntity& entity : model.entities) {
    if (entity.label == EntityLabel::floor && is_solid(entity)) largest = std::max(largest, area(entity));
  }
  std::optional<double> height;
  for (const ModelEntity& entity : model.entities) {
    if (entity.label != EntityLabel::floor || !is_solid(entity) || area(entity) < largest / 4) continue;
    const double top = entity.T_map_body.translation().z() + entity.size.z() / 2;
    height = height ? std::min(*height, top) : top;
  }
  return height;
}

}  // namespace parhelion
