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

/// Meshes with more triangles than this are left out: a page of JSON each.
inline constexpr std::size_t most_mesh_triangles = 100'000;

/// Whole worlds one after the other: who is not in the next one is deleted by it and by a hundred after it,
/// for readers who get only some of them.
class WorldScene {
 public:
  /// A body of which nobody knows what it looks like is a small magenta ball.
  void write(const WorldMessage& world, const simulation::EntityShapes& shapes, JsonText& out);
  /// The names over their heads.
  static void write_names(const WorldMessage& world, JsonText& out);

 private:
  std::set<std::string, std::less<>> there_, next_;
  std::map<std::string, int, std::less<>> gone_;  ///< how often their deletion is still to be said
};

enum class BuildingPart : std::uint8_t { standing, overhead };
/// Walls, floors and what else stands, or what is overhead (ceilings, walls above doors) and would hide it.
/// Doors that MR_WORLD tells of are left out. True: a mesh was too large.
bool write_building(const SemanticModel& model, std::int64_t stamp, BuildingPart part, JsonText& out);

}  // namespace parhelion::station::foxglove
