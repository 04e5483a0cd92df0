// The semantic model of a site: labelled elements of the building in the map frame.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/scene.hpp"
#include "protocols/status.hpp"

namespace parhelion {

enum class EntityLabel : std::uint8_t { wall, floor, ceiling, door, stairs, window, pillar, unknown };

/// A box of the building; size is full lengths along its own x (length), y (thickness), z (height).
struct ModelEntity {
  std::string name;  ///< unique: "wall 7"
  EntityLabel label = EntityLabel::unknown;
  Transform<Map, Body> T_map_body;  ///< at the centre of the box
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
  double confidence = 1;
  bool is_virtual = false;  ///< drawn by an instructor (a virtual wall, glass): injectable
  Material material;
};

struct SemanticModel {
  std::string
      map_id;  ///< id of the map that its coordinates belong to; a mismatch with POSE_COV means no injection
  std::string source;  ///< what it was made from
  std::vector<ModelEntity> entities;
};

/// Reads YAML (schema model.schema.json); `origin` names the file in errors. Overlapping walls of one label
/// are an error that names both (overlap by more than half of the smaller one's volume).
Result<SemanticModel> parse_model(const std::string& yaml, const std::string& origin);
Result<SemanticModel> load_model(const std::string& path);
std::string to_yaml(const SemanticModel& model);
const char* to_string(EntityLabel label);

}  // namespace parhelion
