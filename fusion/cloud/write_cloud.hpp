// Writes clouds to files. A file is written under a temporary name and then renamed, so that no partial file
// is ever visible; an existing file is replaced.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/status.hpp"

namespace parhelion::cloud {

/// The columns of a cloud, whatever its frame.
struct CloudColumns {
  std::span<const Eigen::Vector3f> points, normals;
  std::span<const std::array<std::uint8_t, 3>> colours;
  std::span<const std::uint8_t> labels;
  std::span<const std::uint16_t> scans;
  std::span<const Eigen::Vector3d> viewpoints;

  template <class Frame>
  explicit CloudColumns(const PointCloud<Frame>& cloud)
      : points(cloud.points),
        normals(cloud.normals),
        colours(cloud.colours),
        labels(cloud.labels),
        scans(cloud.scans),
        viewpoints(cloud.viewpoints) {}
};

/// Binary little endian PLY, metres: x y z and, where the cloud has them, nx ny nz (float), red green blue,
/// label (uchar), scan (ushort); viewpoints as "comment viewpoint index x y z". read_scan restores the same
/// bits. Errors: columns of unequal length, points that are not finite, a file that cannot be written.
Status write_ply(const std::filesystem::path& path, const CloudColumns& cloud);

/// Binary PCD 0.7, metres: x y z, normal_x normal_y normal_z, rgb, label (U 1), scan (U 2). Its header has
/// room for one viewpoint: where there are several, none is written. Errors as above.
Status write_pcd(const std::filesystem::path& path, const CloudColumns& cloud);

template <class Frame>
Status write_ply(const std::filesystem::path& path, const PointCloud<Frame>& cloud) {
  return write_ply(path, CloudColumns(cloud));
}
template <class Frame>
Status write_pcd(const std::filesystem::path& path, const PointCloud<Frame>& cloud) {
  return write_pcd(path, CloudColumns(cloud));
}

}  // namespace parhelion::cloud
