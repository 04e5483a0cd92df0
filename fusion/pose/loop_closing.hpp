// Loop closing: detects revisited places and optimises the trajectory for a consistent map.
#pragma once

#include <functional>
#include <vector>

#include "fusion/pose/pose_graph.hpp"
#include "fusion/pose/slam_front_end.hpp"

namespace parhelion::pose {

struct LoopClosingOptions {
  double cell = 0.1;            ///< m, of the surfels of a submap
  double submap_length = 5;     ///< m of path
  double min_path_length = 12;  ///< m of path between two places that may form a loop
  double query_distance = 0.8;  ///< m of path between two scans that are searched for loops
  double reach = 7;           ///< m, distance from a submap's centre within which a scan can be matched to it
  double drift = 0.03;        ///< m per m of path since the last loop, allowed for in the search
  double max_window = 4;      ///< m
  double angle_window = 0.4;  ///< rad
  double min_score = 0.55;    ///< of the correlative search
  double min_explained = 0.6;  ///< fraction of points that the submap explains
  int refinements = 2;         ///< final iterations over all pairs of nearby places
  MatchOptions match;
};

/// The poses of the keyframes after loop closing, in their order; keyframe 0 is fixed. `progress`: 0..1.
std::vector<Pose2> closed_loops(const std::vector<Keyframe>& keyframes, const LoopClosingOptions& options,
                                const std::function<void(double)>& progress = {});

}  // namespace parhelion::pose
