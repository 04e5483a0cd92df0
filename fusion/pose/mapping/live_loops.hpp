// Loop closing during a drive: the map is corrected as soon as several scans agree that the robot is back at
// a place. A part of a comparison or of the optimization per scan, or per 0.2 s between scans, and a graph of
// one pose per metre, so that a scan is never kept waiting.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "fusion/pose/mapping/loop_comparison.hpp"
#include "protocols/time.hpp"

namespace parhelion::pose {

class LiveLoops {
 public:
  /// A smaller window than after a drive: searches use time that scans need.
  static LoopClosingOptions live() {
    LoopClosingOptions options;
    options.drift = 0.015;
    options.max_window = 1.5;
    options.query_distance = 0.8;
    return options;
  }
  explicit LiveLoops(const LoopClosingOptions& options = live()) : options_(options) {}

  /// After each scan, with its stamp. `keyframes`: all, with their current poses; only the last may be new.
  /// Where a loop was closed: how they are to be corrected.
  std::optional<LoopCorrection> update(const std::vector<Keyframe>& keyframes, SensorTime stamp);
  /// The steps and poses of keyframes from `first` on have changed; between two updates.
  void poses_changed(const std::vector<Keyframe>& keyframes, std::size_t first);

 private:
  struct Query {
    std::size_t submap, keyframe;
  };
  void add_keyframe(const std::vector<Keyframe>& keyframes);
  void remember_built(std::size_t submap);
  double window(const Keyframe& keyframe) const;
  void ask(const std::vector<Keyframe>& keyframes);
  bool work(const std::vector<Keyframe>& keyframes);
  void match_one(const LoopSearch& search, const Query& query);
  LoopComparison begin_comparison(const std::vector<Keyframe>& keyframes, std::size_t submap) const;
  void close(const std::vector<Keyframe>& keyframes);
  std::optional<LoopCorrection> optimize(const std::vector<Keyframe>& keyframes);
  LoopCorrection correction(const std::vector<Keyframe>& keyframes);
  std::size_t node_at(std::size_t keyframe) const;

  LoopClosingOptions options_;
  std::vector<Pose2> poses_;  ///< of the keyframes
  std::vector<Submap> submaps_;
  std::vector<std::size_t> nodes_;    ///< keyframes
  std::vector<PoseGraphEdge> chain_;  ///< between nodes
  std::vector<PoseGraphEdge> loops_;  ///< between nodes
  Pose2 since_node_;                  ///< tracked motion since the last node
  Eigen::Matrix3d since_node_covariance_ = Eigen::Matrix3d::Zero();
  std::deque<Query> queries_;
  std::optional<LoopComparison> comparison_;
  std::deque<std::size_t> built_;  ///< submaps that have maps, the last one used at the end
  std::vector<Closure> recent_;
  /// A loop that is being closed: the graph, its poses before, and the old keyframe.
  struct Closing {
    PoseGraphOptimization graph;
    std::vector<Pose2> before;
    std::size_t revisited, keyframes;
  };
  std::optional<Closing> closing_;
  std::size_t next_stretch_ = 0;  ///< first keyframe that is not in a submap yet
  double last_query_driven_ = 0, last_loop_driven_ = 0;
  SensorTime last_scan_;
};

}  // namespace parhelion::pose
