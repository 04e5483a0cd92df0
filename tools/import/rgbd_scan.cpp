#include "tools/import/rgbd_scan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/import/rgbd_floor.hpp"

namespace parhelion::tools {
namespace {

int half_beams(const CameraIntrinsics& camera, double step) {
  const double half = std::atan(std::min(camera.cx, camera.width - 1 - camera.cx) / camera.fx);
  return static_cast<int>(half / step);
}

/// True if a ray from height `eye` to height `end` has entered the band on one side and left it on another.
bool passed_through(double eye, double end, const DepthScanOptions& band) {
  if (eye > band.high) return end < band.low;
  if (eye < band.low) return end > band.high;
  return end < band.low || end > band.high;
}

}  // namespace

LaserDescription describe_depth_scan(const CameraIntrinsics& camera, const DepthScanOptions& options) {
  LaserDescription laser;
  laser.T_base_laser = Transform<Base, Laser>::planar(0, 0, 0, (options.low + options.high) / 2);
  laser.convention.range_min = 0.1F;
  laser.convention.range_max = 10;
  laser.convention.no_return = RangeConvention::Sentinel::infinity;
  laser.noise_sigma = 0.01;
  const int half = half_beams(camera, options.step);
  laser.beams = 2 * half + 1;
  laser.angle_min = -half * options.step;
  laser.angle_increment = options.step;
  char text[240];
  std::snprintf(text, sizeof text,
                "derived: no laser, from DEPTH between %g and %g m above the floor; nearest point of "
                "each bearing, +inf "
                "if the band is free, NaN if unknown",
                options.low, options.high);
  laser.source = text;
  return laser;
}

Scan scan_from_depth(const DepthMillimetres& depth, const CameraIntrinsics& camera,
                     const Transform<Map, Base>& T_map_base,
                     const Transform<Map, DepthOptical>& T_map_optical, const DepthScanOptions& options,
                     SensorTime stamp) {
  constexpr std::size_t against_flying_pixels = 5;
  const int half = half_beams(camera, options.step);
  const auto n = static_cast<std::size_t>(2 * half + 1);
  std::vector<std::vector<float>> found(n);
  std::vector<bool> seen_through(n, false);
  const double eye = T_map_optical.translation().z();
  // Level, with the yaw of the base: bearings and ranges are horizontal even while the base tilts.
  const Eigen::Vector3d at = T_map_base.translation();
  const auto T_level_map = Transform<Map, Base>::planar(at.x(), at.y(), T_map_base.yaw()).inverse();
  const Eigen::Isometry3d T_level_optical = T_level_map.isometry() * T_map_optical.isometry();
  for (int row = 0; row < depth.height; ++row) {
    for (int column = 0; column < depth.width; ++column) {
      const auto mm = depth.mm[static_cast<std::size_t>(row) * static_cast<std::size_t>(depth.width) +
                               static_cast<std::size_t>(column)];
      if (mm == 0) continue;
      const Eigen::Vector3d p = T_level_optical * depth_point(camera, column, row, mm * 1e-3);
      const long beam = std::lround(std::atan2(p.y(), p.x()) / options.step) + half;
      if (beam < 0 || beam >= static_cast<long>(n)) continue;
      const auto i = static_cast<std::size_t>(beam);
      if (p.z() >= options.low && p.z() <= options.high) {
        found[i].push_back(static_cast<float>(std::hypot(p.x(), p.y())));
      } else if (passed_through(eye, p.z(), options)) {
        seen_through[i] = true;
      }
    }
  }
  Scan scan;
  scan.stamp = stamp;
  scan.angle_min = static_cast<float>(-half * options.step);
  scan.angle_increment = static_cast<float>(options.step);
  for (std::size_t i = 0; i < n; ++i) {
    auto& ranges = found[i];
    if (ranges.size() >= against_flying_pixels) {
      std::nth_element(ranges.begin(), ranges.begin() + (against_flying_pixels - 1), ranges.end());
      scan.ranges.push_back(ranges[against_flying_pixels - 1]);
    } else {
      scan.ranges.push_back(seen_through[i] ? std::numeric_limits<float>::infinity()
                                            : std::numeric_limits<float>::quiet_NaN());
    }
  }
  return scan;
}

}  // namespace parhelion::tools
