// The state of the world at an instant: result of physics and input of scans, images and grading.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/scene.hpp"
#include "protocols/time.hpp"

namespace parhelion {

struct BodyState {
  BodyId id = 0;
  std::uint32_t epoch =
      0;  ///< counts spawns and teleports: states of different epochs are never interpolated
  Transform<Map, Body> T_map_body;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();       ///< m/s, map frame, of the body's origin
  Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();  ///< rad/s, map frame
  bool known = true;           ///< false: a real door that no sensor sees; the pose is the last known one
  bool attitude_known = true;  ///< false: a real robot whose roll and pitch are assumed, not measured
};

struct WorldSnapshot {
  SimulationTime stamp;    ///< instant of the poses
  std::uint64_t step = 0;  ///< number of the physics step that made it (the earlier one where interpolated)
  std::shared_ptr<const Scene> scene;
  std::vector<BodyState> bodies;  ///< ascending id, one for each body of `scene` that exists at the stamp
};

/// Calls visit(const BodyDefinition&, BodyState&) for each body that exists at the stamp, in ascending id;
/// the state is const where the world is. Does nothing where the world has no scene. Linear: each list is
/// read once.
template <class World, class Visit>
void for_each_body(World& world, Visit&& visit) {
  if (!world.scene) return;
  auto definition = world.scene->bodies.begin();
  const auto definitions_end = world.scene->bodies.end();
  for (auto& state : world.bodies) {
    while (definition != definitions_end && (*definition)->id < state.id) ++definition;
    if (definition == definitions_end) return;
    if ((*definition)->id == state.id) visit(**definition, state);
  }
}

}  // namespace parhelion
