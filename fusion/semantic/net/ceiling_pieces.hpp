// The boxes that an inclined ceiling consists of in the model. Internal to the semantic net.
#pragma once

#include <vector>

#include "fusion/semantic/net/inclined_plane.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {

/// One box where the plane is about a rectangle, else stretches of it; x goes uphill, and the lower side of a
/// box is the plane. Names are empty.
std::vector<ModelEntity> ceiling_pieces(const InclinedPlane& plane);

}  // namespace parhelion::semantic
