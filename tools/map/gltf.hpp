// Exports semantic models for viewers: glTF 2.0 in one file (Khronos Group, glTF 2.0 specification).
#pragma once

#include <string>

#include "protocols/model.hpp"

namespace parhelion::tools {

/// JSON with an embedded buffer (base64). One named node for each mesh and each entity that is not deleted;
/// materials by label; y up and metres, as glTF requires. `extras` hold label, confidence and part_of.
std::string to_gltf(const SemanticModel& model);

}  // namespace parhelion::tools
