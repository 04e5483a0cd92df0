// Ramps: inclined planes that join floors.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/net/semantic_net.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {

struct FoundRamps {
  std::vector<ModelEntity> ramps;
  std::vector<Eigen::Vector3d> landings;  ///< m, on level plates at upper ends that are not called floor
};

/// Finds planes inclined by 1:20 (what is less steep is no ramp: ADA standards 405) to 20 degrees, of at
/// least 0.5 m by 0.4 m and 8 cm of height with some 0.75 m^2 away from their edges, whose lower or upper end
/// meets a level floor. Regions are grown over plan cells whose surroundings have the same slope (Vosselman
/// et al. 2004, section 3.1). Each is an entity "ramp 1" whose x goes uphill and whose upper side is the
/// ramp's. `labels` (EntityLabel, one per point): floor and unknown points on it become ramp.
/// `voxel`: m, of a voxel map, whose ramps must be 2.5 voxels high and 12 long, else 0.
FoundRamps find_ramps(const cloud::PointCloud<Map>& cloud, std::vector<std::uint8_t>& labels,
                      double voxel = 0);

/// What a ramp leads up to is a floor, even where no step does: adds these plates to the net.
void add_landings(const Segmentation& segmentation, const FoundRamps& found, SemanticNet& net);

}  // namespace parhelion::semantic
