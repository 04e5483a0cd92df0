// Semantic models for viewers: glTF 2.0 in one file (Khronos Group, glTF 2.0 specification).
#pragma once

#include <string>

#include "protocols/model.hpp"

namespace parhelion::tools {

/// JSON with its buffer inside (base64). One node for each entity that is not deleted and for each mesh, with
/// its name; materials by label; y is up and metres are the unit, as glTF has them. `extras` hold label,
/// confidence and part_of.
std::string to_gltf(const SemanticModel& model);

}  // namespace parhelion::tools
