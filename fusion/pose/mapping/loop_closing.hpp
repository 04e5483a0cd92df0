// Loop closing after a drive: detects revisited places and optimises the trajectory for a consistent map.
#pragma once

#include <functional>
#include <vector>

#include "fusion/pose/mapping/loop_search.hpp"

namespace parhelion::pose {

/// The poses of the keyframes after loop closing, in their order; keyframe 0 is fixed. `progress`: 0..1.
std::vector<Pose2> closed_loops(const std::vector<Keyframe>& keyframes, const LoopClosingOptions& options,
                                const std::function<void(double)>& progress = {});

}  // namespace parhelion::pose
