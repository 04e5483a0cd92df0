// Error of a trajectory against independent ground truth: published relations, or reference poses.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::test {

using Trajectory = std::vector<std::pair<SensorTime, Pose2>>;  ///< T_map_base (or T_odom_base) by stamp

inline Trajectory trajectory_of(const std::vector<PoseEstimate>& estimates) {
  Trajectory trajectory;
  for (const PoseEstimate& estimate : estimates)
    trajectory.emplace_back(estimate.stamp, planar(estimate.T_map_base));
  return trajectory;
}

/// The pose at `second` relative to that at `first`.
struct Relation {
  SensorTime first, second;
  Pose2 T_first_second;
};

/// Lines of "t1 t2 x y z roll pitch yaw" (s, m, rad), as in the Freiburg SLAM benchmark.
inline std::vector<Relation> read_relations(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<Relation> relations;
  double t1 = 0, t2 = 0, x = 0, y = 0, z = 0, roll = 0, pitch = 0, yaw = 0;
  while (file >> t1 >> t2 >> x >> y >> z >> roll >> pitch >> yaw)
    relations.push_back({SensorTime::from_utime(std::llround(t1 * 1e6)),
                         SensorTime::from_utime(std::llround(t2 * 1e6)),
                         {x, y, yaw}});
  return relations;
}

/// The reference pose at `stamp`, interpolated between the two around it.
inline std::optional<Pose2> reference_at(const std::vector<PoseStamped>& reference, SensorTime stamp) {
  const auto after = std::lower_bound(reference.begin(), reference.end(), stamp,
                                      [](const PoseStamped& pose, SensorTime t) { return pose.stamp < t; });
  if (after == reference.end() || (after == reference.begin() && after->stamp != stamp)) return std::nullopt;
  if (after->stamp == stamp) return planar(after->T_map_base);
  const PoseStamped& before = *(after - 1);
  const double s = (stamp - before.stamp).seconds() / (after->stamp - before.stamp).seconds();
  return interpolate(planar(before.T_map_base), planar(after->T_map_base), s);
}

/// Relations of reference poses at the stamps of `trajectory`, `apart` stamps from each other.
inline std::vector<Relation> relations_of(const std::vector<PoseStamped>& reference,
                                          const Trajectory& trajectory, std::size_t apart) {
  std::vector<Relation> relations;
  for (std::size_t i = 0; i + apart < trajectory.size(); ++i) {
    const SensorTime first = trajectory[i].first, second = trajectory[i + apart].first;
    const auto a = reference_at(reference, first), b = reference_at(reference, second);
    if (a && b) relations.push_back({first, second, a->inverse() * *b});
  }
  return relations;
}

struct RelationError {
  std::size_t relations = 0;             ///< those with both ends in the trajectory
  double mean = 0, median = 0, p90 = 0;  ///< m, translation
  double mean_turn = 0;                  ///< rad
};

/// Translational error of relations (Kuemmerle et al. 2009).
inline RelationError relation_error(const Trajectory& trajectory, const std::vector<Relation>& relations) {
  std::map<std::int64_t, Pose2> at;
  for (const auto& [stamp, pose] : trajectory) at[stamp.utime()] = pose;
  std::vector<double> errors;
  RelationError result;
  for (const Relation& relation : relations) {
    const auto a = at.find(relation.first.utime()), b = at.find(relation.second.utime());
    if (a == at.end() || b == at.end()) continue;
    const Pose2 off = relation.T_first_second.inverse() * (a->second.inverse() * b->second);
    errors.push_back(off.position().norm());
    result.mean += errors.back();
    result.mean_turn += std::abs(wrap_angle(off.yaw));
  }
  if (errors.empty()) return result;
  std::sort(errors.begin(), errors.end());
  result.relations = errors.size();
  result.mean /= static_cast<double>(errors.size());
  result.mean_turn /= static_cast<double>(errors.size());
  result.median = errors[errors.size() / 2];
  result.p90 = errors[errors.size() * 9 / 10];
  return result;
}

/// T_reference_map: the rigid motion that brings the positions of `trajectory` nearest to the reference,
/// which is interpolated at each stamp. nullopt: they have no stamp in common.
inline std::optional<Pose2> alignment(const Trajectory& trajectory,
                                      const std::vector<PoseStamped>& reference) {
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> pairs;
  for (const auto& [stamp, pose] : trajectory) {
    if (const auto truth = reference_at(reference, stamp))
      pairs.emplace_back(truth->position(), pose.position());
  }
  if (pairs.empty()) return std::nullopt;
  const auto count = static_cast<double>(pairs.size());
  Eigen::Vector2d mean_a(0, 0), mean_b(0, 0);
  for (const auto& [a, b] : pairs) mean_a += a / count, mean_b += b / count;
  double sine = 0, cosine = 0;
  for (const auto& [a, b] : pairs) {
    const Eigen::Vector2d u = a - mean_a, v = b - mean_b;
    cosine += v.dot(u);
    sine += v.x() * u.y() - v.y() * u.x();
  }
  const double yaw = std::atan2(sine, cosine);
  const Eigen::Vector2d shift = mean_a - Eigen::Rotation2Dd(yaw) * mean_b;
  return Pose2{shift.x(), shift.y(), yaw};
}

struct AlignedError {
  std::size_t poses = 0;
  double rmse = 0, max = 0;  ///< m
};

/// Position error after alignment().
inline AlignedError aligned_error(const Trajectory& trajectory, const std::vector<PoseStamped>& reference) {
  AlignedError result;
  const auto T_reference_map = alignment(trajectory, reference);
  if (!T_reference_map) return result;
  double squares = 0;
  for (const auto& [stamp, pose] : trajectory) {
    const auto truth = reference_at(reference, stamp);
    if (!truth) continue;
    const double d = (truth->position() - *T_reference_map * pose.position()).norm();
    squares += d * d;
    result.max = std::max(result.max, d);
    ++result.poses;
  }
  result.rmse = std::sqrt(squares / static_cast<double>(result.poses));
  return result;
}

}  // namespace parhelion::test
