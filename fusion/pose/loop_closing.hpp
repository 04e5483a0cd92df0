// The other half of mapping: finds where the robot came back, and bends the trajectory so that the map agrees
// with itself.
#pragma once

#include <functional>
#include <vector>

#include "fusion/pose/mapping_front.hpp"
#include "fusion/pose/pose_graph.hpp"

namespace parhelion::pose {

struct LoopClosingOptions {
  double cell = 0.1;             ///< m, of the surfels of a submap
  double submap_length = 5;      ///< m of way
  double least_way = 12;         ///< m of way between two places that may be a loop
  double query_distance = 0.8;   ///< m of way between two scans that are searched for loops
  double reach = 7;              ///< m from a submap's middle in which a scan can be matched to it
  double drift = 0.03;           ///< m per m of way since the last loop, that the search allows for
  double most_window = 4;        ///< m
  double angle_window = 0.4;     ///< rad
  double least_score = 0.55;     ///< of the correlative search
  double least_explained = 0.6;  ///< share of points that the submap explains
  int refinements = 2;           ///< rounds over all pairs of near places at the end
  MatchOptions match;
};

/// The poses of the keyframes after all loops are closed, in their order; keyframe 0 stays. `progress`: 0..1.
std::vector<Pose2> closed_loops(const std::vector<Keyframe>& keyframes, const LoopClosingOptions& options,
                                const std::function<void(double)>& progress = {});

}  // namespace parhelion::pose
