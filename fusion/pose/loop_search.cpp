#include "fusion/pose/loop_search.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace parhelion::pose {

std::size_t end_of_stretch(std::span<const Keyframe> keyframes, std::size_t begin,
                           const LoopClosingOptions& options) {
  std::size_t end = begin + 1;
  while (end < keyframes.size() && keyframes[end].driven - keyframes[begin].driven < options.submap_length)
    ++end;
  return end;
}

Submap LoopSearch::submap(std::size_t begin, std::size_t end) const {
  Submap submap;
  submap.begin = begin, submap.end = end;
  submap.anchor = begin + (end - begin) / 2;
  submap.surfels = std::make_unique<SurfelMap>(options_.cell);
  const double margin = options_.submap_length / 2;
  const Pose2 T_anchor_map = poses_[submap.anchor].inverse();
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    if (keyframes_[i].driven < keyframes_[begin].driven - margin) continue;
    if (keyframes_[i].driven > keyframes_[end - 1].driven + margin) break;
    const Pose2 T_anchor_base = T_anchor_map * poses_[i];
    submap.surfels->add(keyframes_[i].scan.points, T_anchor_base);
    for (const Eigen::Vector2d& p : thinned(keyframes_[i].scan.points, 180))
      submap.points.push_back(T_anchor_base * p);
  }
  return submap;
}

bool LoopSearch::may_close(std::size_t keyframe, const Submap& submap, double window) const {
  const double driven_distance = std::abs(keyframes_[keyframe].driven - keyframes_[submap.anchor].driven);
  return driven_distance > options_.min_path_length &&
         (poses_[keyframe].position() - poses_[submap.anchor].position()).norm() < options_.reach + window;
}

std::optional<Closure> LoopSearch::matched_from(const Submap& submap, std::size_t index, std::size_t keyframe,
                                                const Pose2& T_anchor_base) const {
  const Match found = match(*submap.surfels, keyframes_[keyframe].scan.points, T_anchor_base, T_anchor_base,
                            Eigen::Matrix3d::Zero(), options_.match);
  if (found.explained < options_.min_explained) return std::nullopt;
  // Directions that the points leave open (a corridor) stay open; accuracy is limited to 1 cm and 0.3
  // degrees.
  const Eigen::Matrix3d regular = Eigen::Vector3d(1, 1, 10).asDiagonal();
  const Eigen::Matrix3d floor = Eigen::Vector3d(1e-4, 1e-4, 2.7e-5).asDiagonal();
  const Eigen::Matrix3d covariance = (found.information + regular).inverse() + floor;
  Closure closure{index,
                  keyframe,
                  {submap.anchor, keyframe, found.T_map_base, covariance.inverse(), true},
                  {},
                  poses_[keyframe].position()};
  const Pose2 T_map_found = poses_[submap.anchor] * found.T_map_base;
  closure.correction = T_map_found * poses_[keyframe].inverse();
  return closure;
}

std::optional<Closure> LoopSearch::matched(const Submap& submap, std::size_t index,
                                           std::size_t keyframe) const {
  return matched_from(submap, index, keyframe, poses_[submap.anchor].inverse() * poses_[keyframe]);
}

std::optional<Closure> LoopSearch::searched(Submap& submap, std::size_t index, std::size_t keyframe,
                                            double window) const {
  if (!submap.likelihood)
    submap.likelihood = std::make_unique<CorrelativeMap>(submap.points, options_.cell, 6);
  const Pose2 expected = poses_[submap.anchor].inverse() * poses_[keyframe];
  const auto candidates = submap.likelihood->search(thinned(keyframes_[keyframe].scan.points, 90),
                                                    {expected, window, window, options_.angle_window},
                                                    {options_.min_score, 1, 0.5, 0.3});
  if (candidates.empty()) return std::nullopt;
  return matched_from(submap, index, keyframe, candidates.front().T_map_base);
}

std::vector<std::size_t> consistent(std::span<const Closure> closures) {
  constexpr std::size_t enough = 3;
  std::vector<std::size_t> best;
  for (const Closure& seed : closures) {
    std::vector<std::size_t> agree;
    for (std::size_t i = 0; i < closures.size(); ++i) {
      // Compared at the scan's position, not at the map's origin.
      const Eigen::Vector2d p = closures[i].place;
      if (std::abs(wrap_angle(seed.correction.yaw - closures[i].correction.yaw)) < 0.06 &&
          (seed.correction * p - closures[i].correction * p).norm() < 0.2) {
        agree.push_back(i);
      }
    }
    if (agree.size() > best.size()) best = agree;
  }
  if (best.size() < enough || 2 * best.size() < closures.size()) return {};
  return best;
}

}  // namespace parhelion::pose
