// What the classifier of things sees of one: its measures, how it fills its box, and where it stands.
// Internal to the objects, but for the program that trains the classifier.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "fusion/semantic/objects/object_shape.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {

inline constexpr std::size_t kObjectFeatures = 34;
/// In m, or fractions of the thing's box; 3 m stands for any larger distance.
using ObjectFeatures = std::array<float, kObjectFeatures>;

ObjectFeatures features_of(const ObjectGrid& grid, const ObjectGroup& group, const ObjectShape& shape,
                           const std::vector<ModelEntity>& entities);

}  // namespace parhelion::semantic
