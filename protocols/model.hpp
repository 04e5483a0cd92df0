// The semantic model of a site: labelled elements of the building in the map frame.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/scene.hpp"
#include "protocols/status.hpp"

namespace parhelion {

enum class EntityLabel : std::uint8_t {
  wall,
  floor,
  ceiling,
  door,
  stairs,  ///< one step each; `part_of` names the flight
  window,
  pillar,
  unknown,          ///< something is there, and it is solid
  wall_above_door,  ///< the piece of wall above a door's opening
  free_space,       ///< of a door: the empty volume that its leaf sweeps; never solid
  ramp,             ///< an inclined floor: its own x goes uphill, its upper side is driven on
};
constexpr std::size_t kEntityLabels = 11;

/// The hinge of a door, in the door's own frame (centre of its box, as drawn). Angles turn the leaf from
/// there, counter-clockwise seen from above.
struct Hinge {
  Eigen::Vector2d axis = Eigen::Vector2d::Zero();  ///< m, position of the vertical axis, x along the door
  double lower = 0, upper = 1.5707963;             ///< rad, limits
  double closed = 0;  ///< rad, angle of the closed leaf; other than 0 where it is drawn open
};

/// A box of the building; size is the full lengths along its own x (length), y (thickness), z (height).
struct ModelEntity {
  std::string name;  ///< unique: "wall 7"
  EntityLabel label = EntityLabel::unknown;
  Transform<Map, Body> T_map_body;  ///< at the centre of the box
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
  double confidence = 1;
  bool is_virtual = false;  ///< drawn by an instructor (a virtual wall, glass): injectable
  Material material;
  std::string part_of;         ///< the larger object that it is a part of: "stairs 1"; empty: none
  std::optional<Hinge> hinge;  ///< doors only
  double observed = 1;         ///< fraction of its surface that scans have measured, 0..1
  bool locked = false;         ///< set by a user: kept unchanged when the model is rebuilt
  bool deleted = false;        ///< set by a user: removed, and not detected again when the model is rebuilt
};

/// The entity's box as a shape: it has the entity's own frame.
inline Transform<Map, ShapeFrame> T_map_box(const ModelEntity& entity) {
  return entity.T_map_body.as<Map, ShapeFrame>();
}

/// Whether it stops bodies and blocks the line of sight.
inline bool is_solid(const ModelEntity& entity) {
  return entity.label != EntityLabel::free_space && !entity.deleted;
}

/// Whether robots and persons stand on it: a floor or a ramp.
inline bool is_ground(EntityLabel label) { return label == EntityLabel::floor || label == EntityLabel::ramp; }

/// Relations of the semantic net (paper 2.3, 2.4).
enum class RelationKind : std::uint8_t {
  parallel,
  orthogonal,
  above,
  under,
  equal_height,
  available_inside,     ///< `from` (a door, a window, a free space) lies in the opening of `to` (a wall)
  connected_via_joint,  ///< `from` (a door) hangs on `to` (a wall)
};

struct Relation {
  RelationKind kind = RelationKind::parallel;
  std::string from, to;   ///< names of entities
  double confidence = 1;  ///< 0..1
};

/// Triangles of objects that are not boxes: furniture and others labelled "unknown". Collide and occlude.
struct ModelMesh {
  std::string name;
  std::vector<Eigen::Vector3f> vertices;                ///< m, map frame
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< into vertices, counter-clockwise from outside
  bool empty() const { return triangles.empty(); }
};

struct SemanticModel {
  std::string
      map_id;  ///< id of the map that its coordinates belong to; a mismatch with POSE_COV prevents injection
  std::string source;  ///< what the model was made from
  std::vector<ModelEntity> entities;
  std::vector<Relation> relations;
  std::vector<ModelMesh> meshes;
  Transform<Map, Cloud> T_map_cloud;  ///< levelling and placement of the cloud that it was made from
};

/// Reads YAML (schema model.schema.json); `origin` names the file in errors. Overlapping walls of one label
/// are an error that names both (overlap by more than half of the smaller one's volume; free spaces and
/// deleted entities may overlap); so are a hinge on an entity that is not a door, a relation to a missing
/// entity, a mesh that is not finite or has an invalid vertex index, more than a million triangles.
Result<SemanticModel> parse_model(const std::string& yaml, const std::string& origin);
Result<SemanticModel> load_model(const std::string& path);
std::string to_yaml(const SemanticModel& model);
const char* to_string(EntityLabel label);
const char* to_string(RelationKind kind);

}  // namespace parhelion
