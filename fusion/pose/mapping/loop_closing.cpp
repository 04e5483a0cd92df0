#include "fusion/pose/mapping/loop_closing.hpp"

#include <map>

#include "fusion/pose/mapping/loop_comparison.hpp"

namespace parhelion::pose {
namespace {

class LoopCloser {
 public:
  LoopCloser(const std::vector<Keyframe>& keyframes, const LoopClosingOptions& options)
      : keyframes_(keyframes), options_(options) {
    if (!keyframes.empty()) poses_.push_back(keyframes.front().T_map_base);
    for (std::size_t i = 1; i < keyframes.size(); ++i) {
      const WeakMotion& weak = keyframes[i].weak_motion;
      const Eigen::Vector2d correction =
          options.odometry_weight * (options.odometry_scale * weak.reported - weak.tracked);
      const auto rescaled = [&](const Pose2& step) {
        return Pose2{step.x + correction.x(), step.y + correction.y(), step.yaw};
      };
      chain_.push_back({i - 1, i, rescaled(keyframes[i].step), keyframes[i].step_information, false});
      poses_.push_back(poses_.back() *
                       rescaled(keyframes[i - 1].T_map_base.inverse() * keyframes[i].T_map_base));
    }
  }

  std::vector<Pose2> run(const std::function<void(double)>& progress) {
    if (keyframes_.size() < 3) return poses_;
    for (std::size_t begin = 0; begin < keyframes_.size();) {
      const std::size_t end = end_of_stretch(keyframes_, begin, options_);
      submaps_.push_back(search().submap(begin, end));
      begin = end;
    }
    for (std::size_t s = 0; s < submaps_.size(); ++s) {
      search_stretch(s);
      if (progress) progress(0.6 * static_cast<double>(s + 1) / static_cast<double>(submaps_.size()));
    }
    for (int round = 0; round < options_.refinements; ++round) {
      refine();
      if (progress) progress(0.6 + 0.4 * (round + 1) / options_.refinements);
    }
    return poses_;
  }

 private:
  LoopSearch search() const { return {keyframes_, poses_, options_}; }

  /// Finds loops between the scans of one stretch and older submaps.
  void search_stretch(std::size_t stretch) {
    std::vector<PoseGraphEdge> edges = chain_;
    edges.insert(edges.end(), loops_.begin(), loops_.end());
    const std::vector<double> apart = shortest_paths(edges, poses_.size(), submaps_[stretch].anchor);
    bool any = false;
    for (std::size_t s = 0; s < stretch; ++s) {
      const std::vector<Closure> found = compared(stretch, s, options_.window(apart[submaps_[s].anchor]));
      for (std::size_t i : consistent(found)) loops_.push_back(found[i].edge), any = true;
    }
    release_maps(stretch);
    if (any) optimize(2);
  }

  /// The scans of a stretch, matched to a submap.
  std::vector<Closure> compared(std::size_t stretch, std::size_t submap, double window) {
    const Submap& own = submaps_[stretch];
    std::vector<std::size_t> scans;
    double last = -options_.query_distance;
    for (std::size_t k = own.begin; k < own.end; ++k) {
      if (keyframes_[k].driven - last < options_.query_distance) continue;
      if (!search().may_close(k, submaps_[submap], window)) continue;
      last = keyframes_[k].driven;
      scans.push_back(k);
    }
    if (scans.empty()) return {};
    searched_in_[submap] = stretch;
    LoopComparison comparison(submap, std::move(scans), window);
    while (!comparison.step(search(), submaps_[submap])) {
    }
    return std::move(comparison.closures());
  }

  /// Each takes up to 20 MB outdoors. Those near the path are needed again soon.
  void release_maps(std::size_t stretch) {
    constexpr std::size_t kept = 3;  // stretches
    for (auto searched = searched_in_.begin(); searched != searched_in_.end();) {
      const bool old = searched->second + kept < stretch;
      if (old) submaps_[searched->first].release();
      searched = old ? searched_in_.erase(searched) : std::next(searched);
    }
  }

  /// Matches all pairs of nearby places again, from the current poses.
  void refine() {
    for (Submap& submap : submaps_) submap.release();
    loops_.clear();
    for (std::size_t s = 0; s < submaps_.size(); ++s) {
      double last_query = -options_.query_distance;
      for (std::size_t k = 0; k < keyframes_.size(); ++k) {
        if (std::abs(keyframes_[k].driven - last_query) < options_.query_distance / 2) continue;
        if (!search().may_close(k, submaps_[s], 0)) continue;
        last_query = keyframes_[k].driven;
        const auto closure = search().matched(submaps_[s], s, k);
        if (!closure) continue;
        const Pose2 moved =
            (poses_[submaps_[s].anchor].inverse() * poses_[k]).inverse() * closure->edge.T_from_to;
        if (moved.position().norm() < 0.3 && std::abs(moved.yaw) < 0.1) loops_.push_back(closure->edge);
      }
      submaps_[s].release();
    }
    optimize(3);
  }

  void optimize(int rounds) {
    std::vector<PoseGraphEdge> edges = chain_;
    edges.insert(edges.end(), loops_.begin(), loops_.end());
    poses_ = optimize_pose_graph(poses_, edges, rounds);
  }

  const std::vector<Keyframe>& keyframes_;
  LoopClosingOptions options_;
  std::vector<Pose2> poses_;
  std::vector<PoseGraphEdge> chain_, loops_;
  std::vector<Submap> submaps_;
  std::map<std::size_t, std::size_t> searched_in_;  ///< by submap with maps: the last stretch
};

}  // namespace

std::vector<Pose2> closed_loops(const std::vector<Keyframe>& keyframes, const LoopClosingOptions& options,
                                const std::function<void(double)>& progress) {
  return LoopCloser(keyframes, options).run(progress);
}

}  // namespace parhelion::pose
