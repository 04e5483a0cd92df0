// Clouds from what a robot's sensors measure: a depth image, or the scan lines of a laser that is moved.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/image.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"

namespace parhelion {

struct DepthCloudOptions {
  int step = 1;                           ///< every n-th pixel of every n-th row
  double range_min = 0, range_max = 100;  ///< m along the optical axis
};

/// One point for each pixel that measured, in the camera's optical frame, in the order of the pixels; the
/// viewpoint is its origin. `millimetres`: row by row, along the optical axis, 0 and 65535 nothing. Lens
/// distortion is taken out. Errors: a size that is not the camera's, intrinsics or options out of range.
Result<PointCloud<DepthOptical>> cloud_from_depth(std::span<const std::uint16_t> millimetres,
                                                  const CameraIntrinsics& camera,
                                                  const DepthCloudOptions& options = {});

/// Where the laser is at an instant; nullopt: not known.
using LaserPoseAt = std::function<std::optional<Transform<Scanner, Laser>>(SensorTime)>;

struct LineCloud {
  PointCloud<Scanner> cloud;       ///< in the order of lines and beams; one viewpoint: the laser's mean place
  std::uint64_t without_pose = 0;  ///< lines left out
};

/// Scan lines into one 3D scan: each hit at its own beam's time (LaserDescription::beam_time) and place. A
/// line whose first or last beam has no pose is left out. Errors: no line with a pose, no hit at all.
Result<LineCloud> cloud_from_lines(std::span<const Scan> lines, const LaserDescription& laser,
                                   const LaserPoseAt& pose_at);

/// A depth camera's cloud with the axes of a level frame (a map's), the origin where the camera is.
template <class Level>
PointCloud<Scanner> turned_level(const PointCloud<DepthOptical>& cloud,
                                 const Transform<Level, DepthOptical>& T_level_optical) {
  return transformed(Transform<Scanner, DepthOptical>(T_level_optical.quaternion(), Eigen::Vector3d::Zero()),
                     cloud);
}

}  // namespace parhelion
