// The semantic net (paper 2.3): labelled entities and their relations from surfaces. Labels are assigned
// jointly: each candidate has a likelihood for each label from its own shape, each pair a compatibility for
// each pair of labels, and the best joint assignment is chosen.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

struct SemanticNetOptions {
  double door_width_min = 0.6, door_width_max = 1.3;    ///< m
  double double_door_width_max = 2.2;                   ///< m, of one under a lintel that was measured
  double door_height_min = 1.9, door_height_max = 2.4;  ///< m
  double rise_min = 0.10, rise_max = 0.24;              ///< m, of a step
  double tread_min = 0.18, tread_max = 1.2;             ///< m
  double voxel = 0;                                     ///< m, side of the voxels of a voxel map; 0: none
};

/// Why an entity got its label: for reports and for the picture of the net.
struct LabelEvidence {
  std::string entity;
  std::array<double, kEntityLabels> likelihood{};  ///< per EntityLabel, from its own shape; sums to 1
  std::array<double, kEntityLabels> belief{};      ///< per EntityLabel, after the relations; sums to 1
  std::vector<Relation> supports;                  ///< relations that support the label
};

/// One step of a flight, or one flight; as in the summary.
struct StairsFlight {
  std::string name;
  std::vector<double> rises;   ///< m
  std::vector<double> treads;  ///< m
  double confidence = 0;
};

struct SemanticNet {
  std::vector<ModelEntity> entities;
  std::vector<Relation> relations;
  std::vector<LabelEvidence> evidence;  ///< one for each entity
  std::vector<StairsFlight> stairs;
  std::vector<std::uint8_t> labels;  ///< per point of the cloud: EntityLabel; unknown where none
};

/// Errors: a segmentation that does not fit the cloud. Uses the threads of the calling task arena; the same
/// for any number.
Result<SemanticNet> label_entities(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation,
                                   const SemanticNetOptions& options = {});

}  // namespace parhelion::semantic
