#include "fusion/semantic/objects/classify_object.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "fusion/semantic/objects/kind_trees.hpp"
#include "fusion/semantic/objects/usual_shapes.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kNever = 20;  ///< log-odds

/// Chairs and tables stand in gardens, too.
bool is_of_rooms(ObjectKind kind) {
  return kind == ObjectKind::counter || kind == ObjectKind::cupboard || kind == ObjectKind::sofa ||
         kind == ObjectKind::bed || kind == ObjectKind::shelf;
}

bool is_victim(const Thing& thing) {
  return thing.posture == Posture::sitting || thing.posture == Posture::lying;
}

/// Log-odds against it. The trees know made-up things only: what is usual for real ones counts as much.
double doubt_in(const Thing& thing, const ObjectShape& shape) {
  constexpr double kMaxOddness = 6, kOfAnything = 0.5;
  // Chairs with arms and bushes are about as large as somebody who sits.
  constexpr double kOddVictim = 0.4;
  // A thing that is lost is worse than a scrap of a wall among the things; and such scraps are thin or low.
  constexpr double kOfBuilding = 1.5, kBroad = 3, kWide = 0.6, kHigh = 0.5;  // .., m, m
  if (thing.building)
    return shape.width > kWide && shape.top - shape.bottom > kHigh ? kOfBuilding + kBroad : kOfBuilding;
  if (thing.kind == ObjectKind::object) return kOfAnything;
  const double odd = oddness(shape, thing.kind, thing.posture);
  return is_victim(thing) && odd > kOddVictim ? kNever : std::min(kMaxOddness, odd);
}

}  // namespace

ObjectClass classify(const ObjectShape& shape, const ObjectFeatures& features, bool outdoors) {
  std::array<double, kThings.size()> odds{};
  for (std::size_t k = 0; k < kThings.size(); ++k) {
    const auto seen = static_cast<double>(evaluate(thing_trees()[k], features));
    // Nothing is a piece of the building only because it is like no thing.
    const bool unlike_building = kThings[k].building && seen < 0;
    const bool elsewhere = outdoors && is_of_rooms(kThings[k].kind);
    odds[k] = unlike_building || elsewhere ? -kNever : seen - doubt_in(kThings[k], shape);
  }
  const auto best = static_cast<std::size_t>(std::max_element(odds.begin(), odds.end()) - odds.begin());
  double sum = 0;
  for (const double each : odds) sum += std::exp(each - odds[best]);
  constexpr double kUnsure = 0.4;
  if (1 / sum < kUnsure) return {ObjectKind::object, Posture::unknown, 0.5, false};
  return {kThings[best].kind, kThings[best].posture, 1 / sum, kThings[best].building};
}

}  // namespace parhelion::semantic
