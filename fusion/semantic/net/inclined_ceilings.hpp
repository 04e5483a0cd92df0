// Inclined ceilings: the undersides of roofs, of vaults made of planes, of flights of stairs.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/net/semantic_net.hpp"

namespace parhelion::semantic {

/// Finds planes inclined by 4 to 75 degrees, of at least 1.5 m^2 and 0.25 m of height, that are seen from
/// below and reach 1.9 m over what lies under them. Without viewpoints a plane counts as seen from below
/// where something was measured under it and nothing over it. Regions are grown over cubes whose points lie
/// on one plane (Vosselman et al. 2004, section 3.1). Each is an entity "ceiling N", or pieces of it "ceiling
/// N.1" where it is no rectangle: boxes whose x goes uphill and whose lower side is the plane. `net.labels`:
/// points on it that are unknown or ceiling become ceiling. A level ceiling most of whose points are on such
/// planes is removed, with its relations.
void add_inclined_ceilings(const cloud::PointCloud<Map>& cloud, SemanticNet& net);

}  // namespace parhelion::semantic
