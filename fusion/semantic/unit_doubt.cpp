#include "fusion/semantic/unit_doubt.hpp"

#include <algorithm>
#include <array>

#include "fusion/semantic/build_model.hpp"

namespace parhelion::semantic {
namespace {

bool is_used_by_people(const ModelEntity& e) {
  constexpr double kSure = 0.7;  // confidence
  return (e.label == EntityLabel::door && e.confidence > kSure) || e.label == EntityLabel::stairs;
}

bool has_used_by_people(const SemanticModel& model) {
  return std::any_of(model.entities.begin(), model.entities.end(), is_used_by_people);
}

}  // namespace

std::optional<OtherUnit> unit_to_try(const SemanticModel& in_metres) {
  constexpr std::array<OtherUnit, 2> kUnits = {OtherUnit{"feet", 0.3048}, OtherUnit{"inches", 0.0254}};
  constexpr double kLow = 2.1, kHigh = 3.6;  // m, of rooms
  const auto floor = ground_floor(in_metres), ceiling = largest_ceiling(in_metres);
  if (!floor || !ceiling || has_used_by_people(in_metres)) return std::nullopt;
  const double height = *ceiling - *floor;
  const auto fits = [&](const OtherUnit& unit) {
    return height * unit.metres > kLow && height * unit.metres < kHigh;
  };
  const auto unit = std::find_if(kUnits.begin(), kUnits.end(), fits);
  return unit != kUnits.end() ? std::optional(*unit) : std::nullopt;
}

bool fits_people(const SemanticModel& in_other_unit) {
  constexpr double kWidest = 1.3;  // m, of a door with one leaf: 4.3 ft
  constexpr int kFewest = 2;
  int doors = 0;
  for (const ModelEntity& e : in_other_unit.entities) {
    if (!is_used_by_people(e)) continue;
    if (e.label == EntityLabel::stairs) return true;
    if (e.size.x() > kWidest) return false;
    ++doors;
  }
  return doors >= kFewest;
}

}  // namespace parhelion::semantic
