// What stands on a cloud's floors and what hangs from its ceilings: the evidence for its up direction.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fusion/semantic/level_patches.hpp"

namespace parhelion::semantic {

/// m along up: the lowest and the highest wide layer of a cloud.
struct RoomHeights {
  double low = 0, high = 0;
};

/// Of layers, at least one: a layer is wide if it has a quarter of the patches of the one that has the most.
RoomHeights room_heights(const std::vector<PatchLayer>& layers);

/// Lower spaces are none for people, but between tops of furniture, steps, or a street and a pavement.
inline constexpr double kLowestSpace = 1.8;  // m

/// Whether each patch is part of a level surface that is longer than furniture: a lowered ceiling, a landing.
std::vector<bool> in_long_surfaces(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& up,
                                   const RoomHeights& room);

/// Patches of things close above the bottom and close below the top of a cloud, without those nearer than
/// `beside` (m) and the ones left out. Walls count as neither, nor do things too thin to be seen.
struct ThingCounts {
  int standing = 0, hanging = 0;
};

ThingCounts count_things(const std::vector<PlanePatch>& patches, const std::vector<bool>& left_out,
                         const Eigen::Vector3d& up, const RoomHeights& room, double beside);

/// How strongly the cloud shows that `up` (unit) is its up direction and not its down direction, in octaves:
/// log2 of how many times more patches stand on its lowest wide surface than hang from its highest, each
/// within 1.2 m, and the same of level plates 0.35 to 1.1 m from them, as of tables and seats; at most 3
/// octaves each. Where wide surfaces are at about one height only, as outdoors: three quarters of the octaves
/// of things on their two sides. Negative: upside down; 0: as much hangs as stands, or little of both.
double standing_evidence(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& up);

}  // namespace parhelion::semantic
