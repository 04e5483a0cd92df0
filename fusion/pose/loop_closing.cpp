#include "fusion/pose/loop_closing.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <memory>
#include <optional>

#include "fusion/pose/correlative.hpp"

namespace parhelion::pose {
namespace {

/// Keyframes of one stretch of the path, as a map in the frame of its middle keyframe.
struct Submap {
  std::size_t anchor = 0, begin = 0, end = 0;  ///< keyframes; [begin, end)
  std::unique_ptr<SurfelMap> surfels;
  std::unique_ptr<CorrelativeMap> likelihood;  ///< built when first searched
  std::vector<Eigen::Vector2d> points;         ///< thinned, for the search
};

/// A scan matched to a submap.
struct Closure {
  std::size_t submap = 0, keyframe = 0;
  PoseGraphEdge edge;
  Pose2 correction;       ///< T_map_found * T_map_expected^-1
  Eigen::Vector2d place;  ///< expected, m, map frame
};

class LoopCloser {
 public:
  LoopCloser(const std::vector<Keyframe>& keyframes, const LoopClosingOptions& options)
      : keyframes_(keyframes), options_(options) {
    for (const Keyframe& keyframe : keyframes) poses_.push_back(keyframe.T_map_base);
    for (std::size_t i = 1; i < keyframes.size(); ++i) {
      chain_.push_back({i - 1, i, poses_[i - 1].inverse() * poses_[i], keyframes[i].step_information, false});
    }
  }

  std::vector<Pose2> run(const std::function<void(double)>& progress) {
    if (keyframes_.size() < 3) return poses_;
    make_submaps();
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
  void make_submaps() {
    submaps_.clear();
    std::size_t begin = 0;
    while (begin < keyframes_.size()) {
      std::size_t end = begin + 1;
      while (end < keyframes_.size() &&
             keyframes_[end].driven - keyframes_[begin].driven < options_.submap_length)
        ++end;
      Submap submap;
      submap.begin = begin, submap.end = end;
      submap.anchor = begin + (end - begin) / 2;
      build(submap);
      submaps_.push_back(std::move(submap));
      begin = end;
    }
  }

  void build(Submap& submap) const {
    submap.surfels = std::make_unique<SurfelMap>(options_.cell);
    submap.points.clear();
    submap.likelihood.reset();
    const double margin = options_.submap_length / 2;
    const Pose2 T_anchor_map = poses_[submap.anchor].inverse();
    for (std::size_t i = 0; i < keyframes_.size(); ++i) {
      if (keyframes_[i].driven < keyframes_[submap.begin].driven - margin) continue;
      if (keyframes_[i].driven > keyframes_[submap.end - 1].driven + margin) break;
      const Pose2 T_anchor_base = T_anchor_map * poses_[i];
      submap.surfels->add(keyframes_[i].scan.points, T_anchor_base);
      for (const Eigen::Vector2d& p : thinned(keyframes_[i].scan.points, 180))
        submap.points.push_back(T_anchor_base * p);
    }
  }

  bool may_close(std::size_t keyframe, const Submap& submap, double window) const {
    const double driven_distance = std::abs(keyframes_[keyframe].driven - keyframes_[submap.anchor].driven);
    return driven_distance > options_.min_path_length &&
           (poses_[keyframe].position() - poses_[submap.anchor].position()).norm() < options_.reach + window;
  }

  /// Matches the scan of `keyframe` to `submap`, starting from `T_anchor_base`.
  std::optional<Closure> matched(std::size_t s, std::size_t keyframe, const Pose2& T_anchor_base,
                                 double min_explained) const {
    const Submap& submap = submaps_[s];
    const Match found = match(*submap.surfels, keyframes_[keyframe].scan.points, T_anchor_base, T_anchor_base,
                              Eigen::Matrix3d::Zero(), options_.match);
    if (found.explained < min_explained) return std::nullopt;
    // Directions that the points leave open (a corridor) stay open; accuracy is limited to 1 cm and 0.3
    // degrees.
    const Eigen::Matrix3d regular = Eigen::Vector3d(1, 1, 10).asDiagonal();
    const Eigen::Matrix3d floor = Eigen::Vector3d(1e-4, 1e-4, 2.7e-5).asDiagonal();
    const Eigen::Matrix3d covariance = (found.information + regular).inverse() + floor;
    Closure closure{s,
                    keyframe,
                    {submap.anchor, keyframe, found.T_map_base, covariance.inverse(), true},
                    {},
                    poses_[keyframe].position()};
    const Pose2 T_map_found = poses_[submap.anchor] * found.T_map_base;
    closure.correction = T_map_found * poses_[keyframe].inverse();
    return closure;
  }

  /// Finds loops between the scans of one stretch and older submaps.
  void search_stretch(std::size_t stretch) {
    const Submap& own = submaps_[stretch];
    const double driven_distance = keyframes_[own.anchor].driven - last_loop_driven_;
    const double window = std::min(options_.max_window, 0.4 + options_.drift * driven_distance);
    std::vector<Closure> taken;
    for (std::size_t s = 0; s < stretch; ++s) {
      std::vector<Closure> found;
      double last_query = -options_.query_distance;
      for (std::size_t k = own.begin; k < own.end; ++k) {
        if (keyframes_[k].driven - last_query < options_.query_distance) continue;
        if (!may_close(k, submaps_[s], window)) continue;
        last_query = keyframes_[k].driven;
        if (auto closure = searched(s, k, window)) found.push_back(std::move(*closure));
      }
      keep_consistent(found, taken);
    }
    if (taken.empty()) return;
    last_loop_driven_ = keyframes_[own.end - 1].driven;
    for (const Closure& closure : taken) loops_.push_back(closure.edge);
    optimize(2);
  }

  std::optional<Closure> searched(std::size_t s, std::size_t keyframe, double window) {
    Submap& submap = submaps_[s];
    if (!submap.likelihood)
      submap.likelihood = std::make_unique<CorrelativeMap>(submap.points, options_.cell, 6);
    const Pose2 expected = poses_[submap.anchor].inverse() * poses_[keyframe];
    const auto candidates = submap.likelihood->search(thinned(keyframes_[keyframe].scan.points, 90),
                                                      {expected, window, window, options_.angle_window},
                                                      {options_.min_score, 1, 0.5, 0.3});
    if (candidates.empty()) return std::nullopt;
    return matched(s, keyframe, candidates.front().T_map_base, options_.min_explained);
  }

  /// One scan may match a wrong place; several of a stretch that agree on the correction are reliable.
  static void keep_consistent(const std::vector<Closure>& found, std::vector<Closure>& taken) {
    constexpr std::size_t enough = 3;
    std::vector<std::size_t> best;
    for (const Closure& seed : found) {
      std::vector<std::size_t> agree;
      for (std::size_t i = 0; i < found.size(); ++i) {
        // Compared at the scan's position, not at the map's origin.
        const Eigen::Vector2d p = found[i].place;
        if (std::abs(wrap_angle(seed.correction.yaw - found[i].correction.yaw)) < 0.06 &&
            (seed.correction * p - found[i].correction * p).norm() < 0.2) {
          agree.push_back(i);
        }
      }
      if (agree.size() > best.size()) best = agree;
    }
    if (best.size() < enough || 2 * best.size() < found.size()) return;
    for (std::size_t i : best) taken.push_back(found[i]);
  }

  /// Matches all pairs of nearby places again, from the current poses.
  void refine() {
    for (Submap& submap : submaps_) build(submap);
    loops_.clear();
    for (std::size_t s = 0; s < submaps_.size(); ++s) {
      double last_query = -options_.query_distance;
      for (std::size_t k = 0; k < keyframes_.size(); ++k) {
        if (std::abs(keyframes_[k].driven - last_query) < options_.query_distance / 2) continue;
        if (!may_close(k, submaps_[s], 0)) continue;
        last_query = keyframes_[k].driven;
        const auto closure =
            matched(s, k, poses_[submaps_[s].anchor].inverse() * poses_[k], options_.min_explained);
        if (!closure) continue;
        const Pose2 moved =
            (poses_[submaps_[s].anchor].inverse() * poses_[k]).inverse() * closure->edge.T_from_to;
        if (moved.position().norm() < 0.3 && std::abs(moved.yaw) < 0.1) loops_.push_back(closure->edge);
      }
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
  double last_loop_driven_ = 0;
};

}  // namespace

std::vector<Pose2> closed_loops(const std::vector<Keyframe>& keyframes, const LoopClosingOptions& options,
                                const std::function<void(double)>& progress) {
  return LoopCloser(keyframes, options).run(progress);
}

}  // namespace parhelion::pose
