// Sizes and heights that are usual for things of a kind. Internal to the objects.
#pragma once

#include "fusion/semantic/objects/object_shape.hpp"
#include "protocols/model_objects.hpp"

namespace parhelion::semantic {

/// How far a shape is from any that is usual for the kind: in softnesses of the ranges, summed over the
/// measures. 0: usual, or nothing is usual for the kind.
double oddness(const ObjectShape& shape, ObjectKind kind, Posture posture);

}  // namespace parhelion::semantic
