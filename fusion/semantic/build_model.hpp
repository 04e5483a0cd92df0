// Builds the semantic model of a site from a registered cloud: level, segment, label, mesh the remaining
// points.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/mirror_images.hpp"
#include "fusion/semantic/net/evidence.hpp"
#include "fusion/semantic/net/semantic_net.hpp"
#include "fusion/semantic/objects/find_objects.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"
#include "fusion/semantic/site_heights.hpp"
#include "fusion/semantic/unknown_mesh.hpp"
#include "protocols/model.hpp"
#include "protocols/model_objects.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

/// The paper's two pipelines from points to surfaces (section 2.2).
enum class SegmentationMethod : std::uint8_t { images, normals };

struct ModelOptions {
  SegmentationMethod method = SegmentationMethod::images;
  SegmentationOptions segmentation;
  SemanticNetOptions net;
  UnknownMeshOptions mesh;
  EvidenceOptions evidence;
  ObjectOptions objects;
  bool floor_to_zero = false;     ///< true: the ground floor is z = 0; false: heights are the cloud's
  std::optional<double> spacing;  ///< m, of a voxel map, where it is known; else it is estimated
  double max_extent = 2000;       ///< m: a larger extent indicates a wrong unit
  /// Up direction given by the user (unit, cloud frame), within 40 degrees; without it z is up, and a cloud
  /// that seems to be upside down is rejected.
  std::optional<Eigen::Vector3d> up;
  bool unit_known = false;  ///< by the user or the file's format: it is no doubt
  std::string unit_advice;  ///< appended to a doubt: how the user can give the unit
  std::string up_advice;    ///< appended to that error and to a doubt: how the user can give the up direction
};

struct BuiltModel {
  SemanticModel model;             ///< T_map_cloud is how the cloud was levelled and moved
  cloud::PointCloud<Map> cloud;    ///< levelled, in the model's frame; labels: EntityLabel per point
  SemanticNet net;                 ///< its entities are in `model`
  bool up_doubtful = false;        ///< the cloud may be upside down or lie on its side; a note says why
  std::string unit_doubt;          ///< why the cloud may not be in metres; empty: nothing shows that
  std::vector<std::string> notes;  ///< for the user: a suspected unit, points left out, what cannot be found
  std::vector<bool> left_out;      ///< per point of the input: not in `cloud`; empty: all are
  double floor = 0;                ///< m, top of the ground floor in the levelled cloud's coordinates
  std::vector<ModelObject> objects;             ///< furniture, whose meshes have its names; kerbs last
  std::vector<ObjectFeatures> object_features;  ///< what the kind of each was chosen by, but of kerbs
  std::vector<std::uint32_t> object_of;         ///< per point: into `objects`, or kNoObject
  SiteHeights heights;                          ///< in the levelled cloud's coordinates
  std::vector<Mirror> mirrors;                  ///< images in those that are `certain` are left out
  double shift = 0;  ///< m, added to the levelled cloud's heights: map z = levelled z + shift
};

/// `progress` (may be empty) receives the name of each stage as it begins and the number of finished stages
/// of five. Errors: an empty cloud; nothing level in it; a cloud that is larger than `max_extent` or higher
/// than a tower (the message suggests the unit).
Result<BuiltModel> build_model(cloud::PointCloud<Cloud> cloud, const ModelOptions& options = {},
                               const std::function<void(const char*, int)>& progress = {});

/// Height of the ground floor's top: the lowest floor of the model with at least half of the area of the
/// largest; nullopt where the model has no floor.
std::optional<double> ground_floor(const SemanticModel& model);

/// Whether its z axis is vertical: a roof's underside may be inclined.
bool is_level(const ModelEntity& entity);

/// Height of the underside of the largest level ceiling; nullopt where the model has none.
std::optional<double> largest_ceiling(const SemanticModel& model);

}  // namespace parhelion::semantic
