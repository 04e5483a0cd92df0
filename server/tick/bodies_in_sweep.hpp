// The bodies that exist during a whole sweep, with their poses at its start and end.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <span>
#include <vector>

#include "fusion/scan/augment.hpp"
#include "protocols/world.hpp"

namespace parhelion::tick {

/// Radius of a sphere around the body's origin that contains all its shapes, m.
inline double bounding_radius(const BodyDefinition& body) {
  double radius = 0;
  for (const Shape& shape : body.shapes)
    radius = std::max(radius, shape.T_body_shape.translation().norm() + parhelion::bounding_radius(shape));
  return radius;
}

/// Whether rays are cast against it as a body: true for everything outside the building's tree.
inline bool is_cast_as_body(const BodyDefinition& body) {
  return body.owner != BodyOwner::building || body.injectable || body.moves;
}
/// A real door: never injected, and part of the building at its current angle.
inline bool is_real_door(const BodyDefinition& body) { return body.moves && !body.injectable; }

/// Fills `motions` with every body that `wanted(definition, state at the end)` accepts and that was neither
/// spawned nor teleported during the sweep: such jumps are never interpolated.
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

/// Groups the bodies of each agent, which are contiguous in `motions`, with the volume that they cover during
/// the sweep.
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
