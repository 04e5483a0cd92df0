// Objects of a site that are no part of the building, and what is doubtful in its model. They stand in the
// model's YAML beside the entities; an object's triangles are the model's mesh of the same name.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"

namespace parhelion {

enum class ObjectKind : std::uint8_t {
  chair,
  table,
  counter,
  cupboard,
  sofa,
  bed,
  shelf,
  plant,
  bin,
  box,
  person,
  car,
  kerb,   ///< a single low step along an edge; not movable
  object  ///< of unknown kind
};
const char* to_string(ObjectKind kind);

/// Of a person, by its shape: it tells a victim from somebody who walks by.
enum class Posture : std::uint8_t { unknown, standing, sitting, lying };
const char* to_string(Posture posture);

/// The upright box around one thing: full lengths along its own x (the longer), y and z.
struct ModelObject {
  std::string name;  ///< unique among objects and meshes: "chair 2"
  ObjectKind kind = ObjectKind::object;
  Posture posture = Posture::unknown;  ///< persons only
  Transform<Map, Body> T_map_body;     ///< at the centre of the box
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
  double confidence = 1;  ///< in the kind, 0..1
  bool movable = true;    ///< a person could push or carry it
  std::string on;         ///< the object that it stands on; empty: a floor
  std::string under;      ///< the object over it: a chair at a table; empty: none
  std::vector<std::string> beside;
  /// Its surface (map frame) where it is a body of its own, as in a session in which it can be pushed. Empty:
  /// its surface is the model's mesh of the same name, a fixed part of the site.
  ModelMesh mesh;
};

/// Something that a person should look at before trusting the model there.
struct ModelDoubt {
  std::string entity;                               ///< its name
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m, map frame
  double extent = 0;                                ///< m, of the doubtful part in the plan
  std::string reason;                               ///< a sentence's part: "measured over 20 % of its height"
};

/// What a model's YAML says beside its entities.
struct ModelRemarks {
  std::vector<ModelObject> objects;
  std::vector<ModelDoubt> doubts;
};

/// The remarks of a model's YAML; without such keys: none. Errors as parse_model's.
Result<ModelRemarks> parse_remarks(const std::string& yaml, const std::string& origin);
Result<ModelRemarks> load_remarks(const std::string& path);
/// Keys to be appended to the YAML of the model; empty where there is nothing to say.
std::string to_yaml(const ModelRemarks& remarks);

}  // namespace parhelion
