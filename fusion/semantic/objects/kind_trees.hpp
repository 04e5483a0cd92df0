// The classifier of things: an ensemble of trees for each. Trained on made-up sites only:
// tests/bench/train_objects.cpp.
#pragma once

#include <array>
#include <span>

#include "fusion/semantic/objects/object_features.hpp"
#include "protocols/boosted_trees.hpp"
#include "protocols/model_objects.hpp"

namespace parhelion::semantic {

/// What the classifier tells apart.
struct Thing {
  const char* name;  ///< of the true kind in made-up sites
  ObjectKind kind;
  Posture posture = Posture::unknown;
  bool building = false;
};
inline constexpr std::array<Thing, 16> kThings{{{"chair", ObjectKind::chair},
                                                {"table", ObjectKind::table},
                                                {"counter", ObjectKind::counter},
                                                {"cupboard", ObjectKind::cupboard},
                                                {"sofa", ObjectKind::sofa},
                                                {"bed", ObjectKind::bed},
                                                {"shelf", ObjectKind::shelf},
                                                {"plant", ObjectKind::plant},
                                                {"bin", ObjectKind::bin},
                                                {"box", ObjectKind::box},
                                                {"standing person", ObjectKind::person, Posture::standing},
                                                {"sitting person", ObjectKind::person, Posture::sitting},
                                                {"lying person", ObjectKind::person, Posture::lying},
                                                {"car", ObjectKind::car},
                                                {"thing", ObjectKind::object},
                                                {"no object", ObjectKind::object, Posture::unknown, true}}};

/// Log-odds of each of `kThings`, by ObjectFeatures.
std::span<const Trees> thing_trees();

}  // namespace parhelion::semantic
