// The bodies of MR_WORLD and the semantic model as foxglove.SceneUpdate, in the map frame.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "protocols/codec.hpp"
#include "protocols/model.hpp"
#include "server/simulation/entity_shapes.hpp"
#include "server/station/foxglove/json_text.hpp"

namespace parhelion::station::foxglove {

/// Larger meshes are left out, since their JSON is too large.
inline constexpr std::size_t kMaxMeshTriangles = 100'000;

/// Writes complete worlds. An entity that disappears is deleted in the next update and in a hundred more, for
/// readers that receive only some updates.
class WorldScene {
 public:
  /// A body of unknown shape is drawn as a small magenta ball.
  void write(const WorldMessage& world, const simulation::EntityShapes& shapes, JsonText& out);
  /// Name labels above the bodies.
  static void write_names(const WorldMessage& world, JsonText& out);

 private:
  std::set<std::string, std::less<>> there_, next_;
  std::map<std::string, int, std::less<>> gone_;  ///< number of deletions still to be sent
};

enum class BuildingPart : std::uint8_t { standing, overhead };
/// Walls, floors and other solid parts, or the overhead parts (ceilings, walls above doors) that would hide
/// them. Doors that MR_WORLD contains are left out. True: a mesh was too large.
bool write_building(const SemanticModel& model, std::int64_t stamp, BuildingPart part, JsonText& out);

}  // namespace parhelion::station::foxglove
