#include "fusion/pose/mapping/loop_search.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <iterator>

namespace parhelion::pose {
namespace {

constexpr double kFar = 50;              ///< m from a submap, beyond which nothing is compared
constexpr std::size_t kKeyframes = 200;  ///< that a map is made from, about: 20 m of path have 130
/// Work of a part of a map, in points, and that of a tile that it makes: some 0.4 ms.
constexpr std::size_t kPart = 4000, kTile = 60;

}  // namespace

std::size_t end_of_stretch(std::span<const Keyframe> keyframes, std::size_t begin,
                           const LoopClosingOptions& options) {
  std::size_t end = begin + 1;
  while (end < keyframes.size() && keyframes[end].driven - keyframes[begin].driven < options.submap_length)
    ++end;
  return end;
}

/// `margin`: m of path before and after.
LoopSearch::Range LoopSearch::with_margin(const Submap& submap, double margin) const {
  Range range{submap.begin, submap.end, 1};
  const double first = keyframes_[submap.begin].driven - margin,
               last = keyframes_[submap.end - 1].driven + margin;
  while (range.begin > 0 && keyframes_[range.begin - 1].driven >= first) --range.begin;
  while (range.end < keyframes_.size() && keyframes_[range.end].driven <= last) ++range.end;
  range.stride = 1 + (range.end - range.begin) / kKeyframes;
  return range;
}

Submap LoopSearch::submap(std::size_t begin, std::size_t end) const {
  return {begin + (end - begin) / 2, begin, end, {}, 0, false, {}};
}

bool LoopSearch::add_surfels(Submap& submap) const {
  const Range range = with_margin(submap, options_.submap_length / 2);
  if (!submap.surfels) {
    submap.surfels = std::make_unique<SurfelMap>(options_.cell);
    submap.next = range.begin;
  }
  const Pose2 T_anchor_map = poses_[submap.anchor].inverse();
  for (std::size_t work = 0; submap.next < range.end && work < kPart; submap.next += range.stride) {
    const Keyframe& keyframe = keyframes_[submap.next];
    const std::size_t tiles = submap.surfels->tiles();
    submap.surfels->add(keyframe.scan.points, T_anchor_map * poses_[submap.next]);
    work += keyframe.scan.points.size() + kTile * (submap.surfels->tiles() - tiles);
  }
  submap.complete = submap.next >= range.end;
  return submap.complete;
}

void LoopSearch::add_surroundings(Submap& submap) const {
  constexpr std::size_t points = 180, beams = 90;
  constexpr std::size_t max_keyframes = 40;  // of a part
  constexpr std::size_t skipped = 2;         // keyframes: one of so many shows what is free
  const Pose2 T_anchor_map = poses_[submap.anchor].inverse();
  if (!submap.surroundings) {
    submap.surroundings = std::make_unique<SubmapContext>();
    submap.surroundings->surfels = std::make_unique<SurfelMap>(options_.cell);
    submap.surroundings->seen = SeenArea({0, 0}, kFar);
    const Range range = with_margin(submap, 1.5 * options_.submap_length);
    submap.surroundings->begin = submap.surroundings->next = range.begin;
    submap.surroundings->end = range.end;
    submap.surroundings->stride = range.stride;
  }
  SubmapContext& result = *submap.surroundings;
  const auto is_far = [](const Eigen::Vector2d& p_anchor) { return !(p_anchor.norm() < kFar); };
  std::vector<Eigen::Vector2d> near;
  std::size_t work = 0, keyframes = 0;
  for (; !result.is_complete() && work < kPart && keyframes < max_keyframes;
       result.next += result.stride, ++keyframes) {
    const std::size_t i = result.next;
    const ScanPoints& scan = keyframes_[i].scan;
    const Pose2 T_anchor_base = T_anchor_map * poses_[i];
    near.clear();
    std::copy_if(scan.points.begin(), scan.points.end(), std::back_inserter(near),
                 [&](const Eigen::Vector2d& p) { return !is_far(T_anchor_base * p); });
    const std::size_t tiles = result.surfels->tiles();
    result.surfels->add(near, T_anchor_base);
    work += near.size() + kTile * (result.surfels->tiles() - tiles);
    for (const Eigen::Vector2d& p : thinned(near, points)) result.points.push_back(T_anchor_base * p);
    if ((i - result.begin) % (skipped * result.stride) != 0) continue;
    const Eigen::Vector2d laser = T_anchor_base * scan.laser;
    for (const Eigen::Vector2d& p : thinned(scan.points, beams))
      result.seen.add_beam(laser, T_anchor_base * p);
  }
}

bool LoopSearch::may_close(std::size_t keyframe, const Submap& submap, double window) const {
  const double driven_distance = std::abs(keyframes_[keyframe].driven - keyframes_[submap.anchor].driven);
  return driven_distance > options_.min_path_length &&
         (poses_[keyframe].position() - poses_[submap.anchor].position()).norm() < options_.reach + window;
}

std::optional<Closure> LoopSearch::matched(Submap& submap, std::size_t index, std::size_t keyframe,
                                           const Pose2& correction) const {
  while (!submap.complete) add_surfels(submap);
  const Pose2 start = poses_[submap.anchor].inverse() * (correction * poses_[keyframe]);
  const Match found = match(*submap.surfels, keyframes_[keyframe].scan.points, start, start,
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
