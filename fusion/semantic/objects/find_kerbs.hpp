// Kerbs: low straight steps between two level grounds, such as a street and its pavement.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/model.hpp"
#include "protocols/model_objects.hpp"

namespace parhelion::semantic {

/// Finds straight steps of 5 to 25 cm, at least 1.5 m long, between two grounds of nearly the same slope that
/// both go on for 0.6 m. Edges of flights and ramps in `entities` are none. Each is an object "kerb 1", not
/// movable: x along the edge, y towards the higher side, the box from the lower to the higher ground and
/// 15 cm deep behind the edge; its confidence is the measured share of its length. `labels`: an EntityLabel
/// per point. `voxel`: m, of a voxel map, whose kerbs must be two voxels high, else 0.
std::vector<ModelObject> find_kerbs(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
                                    const std::vector<ModelEntity>& entities, double voxel = 0);

}  // namespace parhelion::semantic
