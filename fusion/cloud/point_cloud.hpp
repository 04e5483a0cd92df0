// Points of one or several 3D scans in one frame, which is part of the type. REP-103 axes, metres.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "protocols/frames.hpp"

namespace parhelion::cloud {

/// Columns of equal length; all but `points` may be empty. Points are finite: non-finite ones are dropped and
/// counted on input.
template <class Frame>
struct PointCloud {
  std::vector<Eigen::Vector3f> points;               ///< m
  std::vector<Eigen::Vector3f> normals;              ///< unit length, towards the scanner; zero: unknown
  std::vector<std::array<std::uint8_t, 3>> colours;  ///< red, green, blue
  std::vector<std::uint8_t> labels;                  ///< meaning depends on the writer; see fusion/semantic
  std::vector<std::uint16_t> scans;                  ///< index into `viewpoints`; empty: all are of scan 0
  std::vector<Eigen::Vector3d> viewpoints;           ///< m, positions of the scanner; empty: unknown

  std::size_t size() const { return points.size(); }
  bool empty() const { return points.empty(); }
};

/// Transforms the cloud's coordinates, normals and viewpoints to frame A.
template <class A, class B>
PointCloud<A> transformed(const Transform<A, B>& T_a_b, const PointCloud<B>& cloud) {
  PointCloud<A> result{cloud.points, cloud.normals, cloud.colours, cloud.labels, cloud.scans, {}};
  const Eigen::Matrix3f R_a_b = T_a_b.rotation().template cast<float>();
  const Eigen::Vector3f p_a = T_a_b.translation().template cast<float>();
  for (Eigen::Vector3f& point : result.points) point = R_a_b * point + p_a;
  for (Eigen::Vector3f& normal : result.normals) normal = R_a_b * normal;
  result.viewpoints.reserve(cloud.viewpoints.size());
  for (const Eigen::Vector3d& viewpoint : cloud.viewpoints) result.viewpoints.push_back(T_a_b * viewpoint);
  return result;
}

/// Relabels the frame without changing coordinates, where both frames are equal by definition: a cloud that
/// was written in frame A is read back in a file's own frame.
template <class A, class B>
PointCloud<A> renamed(PointCloud<B> cloud) {
  return {std::move(cloud.points), std::move(cloud.normals), std::move(cloud.colours),
          std::move(cloud.labels), std::move(cloud.scans),   std::move(cloud.viewpoints)};
}

}  // namespace parhelion::cloud
