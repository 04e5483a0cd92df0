// The bodies that exist over a whole sweep, with their poses at its two ends.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <span>
#include <vector>

#include "fusion/scan/augment.hpp"
#include "protocols/world.hpp"

namespace parhelion::tick {

/// Radius about the body's origin that holds all its shapes, m.
inline double bounding_radius(const BodyDefinition& body) {
  double radius = 0;
  for (const Shape& shape : body.shapes)
    radius = std::max(radius, shape.T_body_shape.translation().norm() + parhelion::bounding_radius(shape));
  return radius;
}

/// What rays meet as a body: all that is not in the building's tree.
inline bool is_cast_as_body(const BodyDefinition& body) {
  return body.owner != BodyOwner::building || body.injectable || body.moves;
}
/// A door that is really there: never injected, it counts as the building where it stands now.
inline bool is_real_door(const BodyDefinition& body) { return body.moves && !body.injectable; }

/// Fills `motions` with every body that `wanted(definition, state at the end)` accepts and that is the same,
/// neither spawned nor teleported, at both ends: such jumps are never interpolated.
template <class Wanted>
void bodies_in_sweep(const WorldSnapshot& start, const WorldSnapshot& end,
                     std::vector<scan::BodyMotion>& motions, Wanted wanted) {
  motions.clear();
  auto before = start.bodies.begin();
  for_each_body(end, [&](const BodyDefinition& definition, const BodyState& state) {
    while (before != start.bodies.end() && before->id < state.id) ++before;
    if (before == start.bodies.end() || before->id != state.id || before->epoch != state.epoch) return;
    if (wanted(definition, state)) motions.push_back({&definition, before->T_map_body, state.T_map_body});
  });
}

/// The bodies of an agent stand together in `motions`; each such row, and where it is over the sweep.
inline void group_bodies(std::span<const scan::BodyMotion> motions, std::vector<scan::BodyGroup>& groups) {
  groups.clear();
  for (std::size_t first = 0, last = 0; first < motions.size(); first = last) {
    Eigen::AlignedBox3d box;
    const auto extend = [&box](const scan::BodyMotion& motion) {
      const Eigen::Vector3d reach = Eigen::Vector3d::Constant(bounding_radius(*motion.body));
      if (!motion.T_map_body_start.finite() || !motion.T_map_body_end.finite()) return;
      for (const auto& T : {motion.T_map_body_start, motion.T_map_body_end})
        box.extend(Eigen::AlignedBox3d(T.translation() - reach, T.translation() + reach));
    };
    for (; last < motions.size() && motions[last].body->entity == motions[first].body->entity; ++last)
      extend(motions[last]);
    if (box.isEmpty()) continue;
    groups.push_back({static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last), box.center(),
                      box.diagonal().norm() / 2});
  }
}

}  // namespace parhelion::tick
