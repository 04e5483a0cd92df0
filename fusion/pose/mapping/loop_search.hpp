// The parts of loop closing: stretches of the path as maps of their own, and scans that are matched to them.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fusion/pose/mapping/pose_graph.hpp"
#include "fusion/pose/mapping/slam_front_end.hpp"
#include "fusion/pose/maps/seen_area.hpp"
#include "fusion/pose/matching/correlative.hpp"

namespace parhelion::pose {

struct LoopClosingOptions {
  double cell = 0.1;            ///< m, of the surfels of a submap
  double submap_length = 5;     ///< m of path
  double min_path_length = 12;  ///< m of path between two places that may form a loop
  double query_distance = 0.8;  ///< m of path between two scans that are searched for loops
  double reach = 7;           ///< m, distance from a submap's centre within which a scan can be matched to it
  double drift = 0.03;        ///< m per m of path between two places, allowed for in the search
  double max_window = 10;     ///< m
  double angle_window = 0.4;  ///< rad
  double min_explained = 0.6;  ///< fraction of points that the submap explains
  /// Scale of odometry over the whole drive, and the weight of the distance by odometry where scans do not
  /// determine it (OdometryScale::weight); 0: odometry had no constant scale.
  double odometry_scale = 1, odometry_weight = 0;
  int refinements = 2;  ///< final iterations over all pairs of nearby places
  MatchOptions match;

  /// m, half side of the search, between places that are `driven` m of path apart.
  double window(double driven) const { return std::min(max_window, 0.4 + drift * driven); }
};

/// More of the path around a submap, to search in and to judge what is found, as far as 50 m from it. In the
/// submap's frame.
struct SubmapContext {
  /// Range of keyframes, every `stride`-th; those from `next` on are still to be added.
  std::size_t begin = 0, next = 0, end = 0, stride = 1;
  std::unique_ptr<SurfelMap> surfels;
  std::unique_ptr<CorrelativeMap> likelihood;  ///< empty until it is needed
  std::vector<Eigen::Vector2d> points;         ///< thinned, for the likelihood
  SeenArea seen;

  bool is_complete() const { return next >= end; }
};

/// Keyframes of one stretch of the path, as a map in the frame of its middle keyframe.
struct Submap {
  std::size_t anchor = 0, begin = 0, end = 0;   ///< keyframes; [begin, end)
  std::unique_ptr<SurfelMap> surfels;           ///< empty until it is needed
  std::size_t next = 0;                         ///< keyframe that is to be added to them
  bool complete = false;                        ///< none is left
  std::unique_ptr<SubmapContext> surroundings;  ///< empty until it is searched; takes up to 20 MB outdoors

  void release() {
    surfels.reset();
    surroundings.reset();
    complete = false;
  }
};

/// A scan matched to a submap.
struct Closure {
  std::size_t submap = 0, keyframe = 0;
  PoseGraphEdge edge;
  Pose2 correction;       ///< T_map_found * T_map_expected^-1
  Eigen::Vector2d place;  ///< expected, m, map frame
};

/// The first keyframe after the stretch that begins with `begin`.
std::size_t end_of_stretch(std::span<const Keyframe> keyframes, std::size_t begin,
                           const LoopClosingOptions& options);

/// Keyframes and their poses, in the same order.
class LoopSearch {
 public:
  LoopSearch(std::span<const Keyframe> keyframes, std::span<const Pose2> poses,
             const LoopClosingOptions& options)
      : keyframes_(keyframes), poses_(poses), options_(options) {}

  std::span<const Keyframe> keyframes() const { return keyframes_; }
  std::span<const Pose2> poses() const { return poses_; }
  const LoopClosingOptions& options() const { return options_; }

  /// A stretch whose maps are still empty.
  Submap submap(std::size_t begin, std::size_t end) const;
  /// Adds keyframes with some thousands of points to the submap's surfels, which have half the stretch's
  /// length of path before and after it, too. True: they are complete. Not to be called again then.
  bool add_surfels(Submap& submap) const;
  /// With one and a half of its lengths before and after it; without a likelihood. Each call adds keyframes
  /// with some thousands of points, until it is complete.
  void add_surroundings(Submap& submap) const;
  /// `window`: m, error of the expected pose.
  bool may_close(std::size_t keyframe, const Submap& submap, double window) const;
  /// Matches the scan of `keyframe`, starting from where `correction` puts it. nullopt: the submap does not
  /// explain it.
  std::optional<Closure> matched(Submap& submap, std::size_t index, std::size_t keyframe,
                                 const Pose2& correction = {}) const;

 private:
  struct Range {
    std::size_t begin, end;  ///< keyframes
    std::size_t stride;      ///< one of so many is enough, where a robot turned on the spot for long
  };
  Range with_margin(const Submap& submap, double margin) const;

  std::span<const Keyframe> keyframes_;
  std::span<const Pose2> poses_;
  const LoopClosingOptions& options_;
};

/// One scan may match a wrong place; several that agree on the correction are reliable. Indices of the
/// largest agreeing set; empty: fewer than three, or less than half.
std::vector<std::size_t> consistent(std::span<const Closure> closures);

}  // namespace parhelion::pose
