#include "fusion/semantic/objects/classify_object.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "fusion/semantic/objects/kind_trees.hpp"
#include "fusion/semantic/objects/usual_shapes.hpp"

namespace parhelion::semantic {
namespace {

/// Log-odds against it. The trees know made-up things only: what is usual for real ones counts as much.
double doubt_in(const Thing& thing, const ObjectShape& shape) {
  constexpr double kMaxOddness = 4, kOfAnything = 0.5;
  // A thing that is lost is worse than a scrap of a wall among the things; and such scraps are thin or low.
  constexpr double kOfBuilding = 1.5, kBroad = 3, kWide = 0.6, kHigh = 0.5;  // .., m, m
  if (thing.building)
    return shape.width > kWide && shape.top - shape.bottom > kHigh ? kOfBuilding + kBroad : kOfBuilding;
  if (thing.kind == ObjectKind::object) return kOfAnything;
  return std::min(kMaxOddness, oddness(shape, thing.kind, thing.posture));
}

}  // namespace

ObjectClass classify(const ObjectShape& shape, const ObjectFeatures& features) {
  std::array<double, kThings.size()> odds{};
  for (std::size_t k = 0; k < kThings.size(); ++k)
    odds[k] = static_cast<double>(evaluate(thing_trees()[k], features)) - doubt_in(kThings[k], shape);
  const auto best = static_cast<std::size_t>(std::max_element(odds.begin(), odds.end()) - odds.begin());
  double sum = 0;
  for (const double each : odds) sum += std::exp(each - odds[best]);
  return {kThings[best].kind, kThings[best].posture, 1 / sum, kThings[best].building};
}

}  // namespace parhelion::semantic
