// Bodies whose shapes are meshes, as foxglove.SceneUpdate: their triangles are sent once, in a frame of each
// body that moves with it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/codec.hpp"
#include "server/simulation/entity_shapes.hpp"
#include "server/station/foxglove/messages.hpp"

namespace parhelion::station::foxglove {

class MeshScene {
 public:
  /// Finds the bodies with meshes. True: others than before, or nothing was written yet, so write() is due.
  bool take(const WorldMessage& world, const simulation::EntityShapes& shapes);
  /// All of them, coarser where a mesh has more than 5,000 triangles, and deletions of those that are gone.
  void write(const WorldMessage& world, const simulation::EntityShapes& shapes, JsonText& out);
  /// Their frames, "<entity>/<part>", in the map; valid until the next take().
  const std::vector<NamedTransform>& frames() const { return frames_; }

 private:
  std::vector<std::string> names_;  // of frames, by body
  std::vector<const WorldMessage::Entry*> bodies_;
  std::vector<NamedTransform> frames_;
  std::optional<std::map<std::string, std::uint32_t, std::less<>>> written_;  // epochs, by name
};

}  // namespace parhelion::station::foxglove
