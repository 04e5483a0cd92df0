// From a registered cloud to the semantic model of the site: level, segment, label, mesh what is left.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/evidence.hpp"
#include "fusion/semantic/segmentation.hpp"
#include "fusion/semantic/semantic_net.hpp"
#include "fusion/semantic/site_heights.hpp"
#include "fusion/semantic/unknown_mesh.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

struct ModelOptions {
  SegmentationOptions segmentation;
  SemanticNetOptions net;
  UnknownMeshOptions mesh;
  EvidenceOptions evidence;
  bool floor_to_zero = false;  ///< the map's z = 0 is the ground floor; else heights are those of the cloud
  double max_extent = 2000;    ///< m: what is larger was given in the wrong unit
  /// A person's word which way is up (unit, cloud frame), to within 40 degrees; without it z is, and a cloud
  /// that seems to be upside down is refused.
  std::optional<Eigen::Vector3d> up;
  std::string up_advice;  ///< ends that refusal: how the caller lets a person say so
};

struct BuiltModel {
  SemanticModel model;           ///< T_map_cloud says how the cloud was levelled and moved
  cloud::PointCloud<Map> cloud;  ///< levelled, in the model's frame; labels: EntityLabel per point
  SemanticNet net;               ///< its entities are in `model`
  std::vector<std::string>
      notes;            ///< what a person should know: a unit that looks wrong, a mesh made coarser
  double floor = 0;     ///< m, top of the ground floor in the levelled cloud's coordinates
  SiteHeights heights;  ///< in the levelled cloud's coordinates
  double shift = 0;     ///< m, added to the levelled cloud's heights: map z = levelled z + shift
};

/// `progress` (may be empty) is told the stage that begins: its name and how many are done of five.
/// Errors: an empty cloud; nothing level in it; a cloud that is larger than `max_extent` or higher than a
/// tower: says which unit it looks like.
Result<BuiltModel> build_model(cloud::PointCloud<Cloud> cloud, const ModelOptions& options = {},
                               const std::function<void(const char*, int)>& progress = {});

/// Height of the ground floor's top: the lowest floor of the model with at least half of the largest
/// one's area; nullopt where the model has no floor.
std::optional<double> ground_floor(const SemanticModel& model);

/// Height of the underside of the largest ceiling; nullopt where the model has none.
std::optional<double> largest_ceiling(const SemanticModel& model);

}  // namespace parhelion::semantic
