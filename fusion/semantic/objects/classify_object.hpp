// What a thing is. Internal to the objects.
#pragma once

#include "fusion/semantic/objects/object_features.hpp"
#include "protocols/model_objects.hpp"

namespace parhelion::semantic {

struct ObjectClass {
  ObjectKind kind = ObjectKind::object;
  Posture posture = Posture::unknown;  ///< of a person
  double confidence = 0.5;
  bool building = false;  ///< no thing at all: a piece of a wall, a step, a floor that was not found as such
};
/// `outdoors`: then it is no furniture of rooms.
ObjectClass classify(const ObjectShape& shape, const ObjectFeatures& features, bool outdoors);

}  // namespace parhelion::semantic
