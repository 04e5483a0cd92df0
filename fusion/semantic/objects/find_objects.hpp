// Objects of a site: what is no part of the building, as instances of a kind with a box, by geometry alone.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/objects/object_features.hpp"
#include "protocols/model.hpp"
#include "protocols/model_objects.hpp"

namespace parhelion::semantic {

inline constexpr std::uint32_t kNoObject = ~std::uint32_t{0};

struct ObjectOptions {
  double cell = 0;            ///< m, of the cubes; 0: by the points' spacing
  bool building_too = false;  ///< what seems to be a piece of the building stays among the objects
};

struct FoundObjects {
  std::vector<ModelObject> objects;
  std::vector<ObjectFeatures> features;  ///< of each: what its kind was chosen by
  std::vector<std::uint32_t> object_of;  ///< per point: into `objects`, or kNoObject
};

/// `labels`: an EntityLabel per point; only points labelled unknown become objects. The entities' floors say
/// what things stand on. The same for any order of the points' equal heights.
FoundObjects find_objects(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
                          const std::vector<ModelEntity>& entities, const ObjectOptions& options = {});

}  // namespace parhelion::semantic
