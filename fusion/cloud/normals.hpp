// Normal vectors of clouds: the paper's algorithm 2, and principal component analysis as its reference.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/status.hpp"

namespace parhelion::cloud {

enum class NormalMethod : std::uint8_t {
  random_planes,  ///< algorithm 2: of the planes through random triples, the one with the smallest sum of
                  ///< distances
  principal,      ///< direction of smallest variance
};

struct NormalOptions {
  NormalMethod method = NormalMethod::principal;
  double bucket_size = 0;  ///< m; the 27 buckets around a point are its neighbourhood; 0: fitted to the cloud
  int planes = 10;         ///< of algorithm 2; the paper's setting
  int max_neighbours = 96;  ///< where there are more, an evenly spaced subset is used
  std::uint64_t seed = 1;   ///< of algorithm 2
  int threads = 0;          ///< 0: all; the result is the same for any number
};

/// One unit normal per point with z >= 0, or zero where the neighbours span no plane (and for points far from
/// all others). Points are finite. Errors: no point, options out of range.
Result<std::vector<Eigen::Vector3f>> estimate_normals(std::span<const Eigen::Vector3f> points,
                                                      const NormalOptions& options = {});

/// Turns each normal towards its point's viewpoint; unchanged where the viewpoint is unknown.
void face_viewpoints(std::span<const Eigen::Vector3f> points, std::span<const std::uint16_t> scans,
                     std::span<const Eigen::Vector3d> viewpoints, std::span<Eigen::Vector3f> normals);

/// Sets the cloud's normals, turned towards its viewpoints.
template <class Frame>
Status add_normals(PointCloud<Frame>& cloud, const NormalOptions& options = {}) {
  auto normals = estimate_normals(cloud.points, options);
  if (!normals) return normals.error();
  cloud.normals = std::move(*normals);
  face_viewpoints(cloud.points, cloud.scans, cloud.viewpoints, cloud.normals);
  return {};
}

}  // namespace parhelion::cloud
