// Clouds from a robot's sensors: a depth image, or the scan lines of a moving laser.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/image.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"

namespace parhelion::cloud {

struct DepthCloudOptions {
  int step = 1;                           ///< every n-th pixel of every n-th row
  double range_min = 0, range_max = 100;  ///< m along the optical axis
};

/// One point for each valid pixel, in the camera's optical frame, in the order of the pixels; the viewpoint
/// is its origin. `millimetres`: row by row, along the optical axis; 0 and 65535 are invalid. Lens distortion
/// is corrected. Errors: a size that is not the camera's, intrinsics or options out of range.
Result<PointCloud<DepthOptical>> cloud_from_depth(std::span<const std::uint16_t> millimetres,
                                                  const CameraIntrinsics& camera,
                                                  const DepthCloudOptions& options = {});

/// Pose of the laser at an instant; nullopt: unknown.
using LaserPoseAt = std::function<std::optional<Transform<Scanner, Laser>>(SensorTime)>;

struct LineCloud {
  PointCloud<Scanner> cloud;  ///< in the order of lines and beams; one viewpoint: the laser's mean position
  std::uint64_t without_pose = 0;  ///< lines left out
};

/// Converts scan lines to one 3D scan: each hit uses the laser's pose at its own beam's time
/// (LaserDescription::beam_time). A line is dropped where its first or last beam has no pose. Errors: no line
/// with a pose, no hit at all.
Result<LineCloud> cloud_from_lines(std::span<const Scan> lines, const LaserDescription& laser,
                                   const LaserPoseAt& pose_at);

/// Instants of a line's earliest and latest beam, relative to its stamp. Interlaced beams are not in order.
struct LineSpan {
  Duration start, end;
};
LineSpan line_span(const LaserDescription& laser, const Scan& line);

/// Whether the laser's plane lies within 20 degrees of base_link's: its lines are then no 3D scan.
bool lies_level(const LaserDescription& laser);

/// A scan line with the laser's pose at the start and the end of its span; motion between them is uniform.
struct PlacedLine {
  Scan line;
  Transform<Map, Laser> T_map_laser_start, T_map_laser_end;
  Transform<Base, Laser> T_base_laser;  ///< at the joint positions of its head
};

/// The robot's own body, whose returns are not part of the site.
struct OwnBody {
  std::vector<Eigen::Vector2d> footprint;  ///< convex, counter-clockwise, m, in base_link; empty: unknown
  double height = 0;                       ///< m
  double margin = 0.05;                    ///< m, around both
};

/// Turns hits on the body into beams without an echo (NaN).
void leave_out_body(Scan& line, const LaserDescription& laser, const Transform<Base, Laser>& T_base_laser,
                    const OwnBody& body);

/// Hits of the lines, in their order, without those on the body. The cloud has a viewpoint for each
/// `viewpoint_distance` (m) that the laser has moved, and the viewpoint of each point.
PointCloud<Map> cloud_from_lines(std::span<const PlacedLine> lines, const LaserDescription& laser,
                                 const OwnBody& body, double viewpoint_distance = 0.1);

/// A depth camera's cloud with the axes of a level frame (a map's) and the camera's position as origin.
template <class Level>
PointCloud<Scanner> turned_level(const PointCloud<DepthOptical>& cloud,
                                 const Transform<Level, DepthOptical>& T_level_optical) {
  return transformed(Transform<Scanner, DepthOptical>(T_level_optical.quaternion(), Eigen::Vector3d::Zero()),
                     cloud);
}

}  // namespace parhelion::cloud
