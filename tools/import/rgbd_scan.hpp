// A planar scan computed from a depth image, marked as not from a laser.
#pragma once

#include "protocols/angle_units.hpp"
#include "protocols/image.hpp"
#include "protocols/scan.hpp"
#include "tools/import/image_files.hpp"

namespace parhelion::tools {

struct DepthScanOptions {
  double low = 0.2, high = 0.5;           ///< m above the floor
  double step = 0.5 * kRadiansPerDegree;  ///< rad between beams
};

/// Description of this camera's scans: centred on base_link's x axis, in the middle of the band.
LaserDescription describe_depth_scan(const CameraIntrinsics& camera, const DepthScanOptions& options);

/// For each bearing the nearest point of the band (the fifth nearest, to suppress single flying pixels), seen
/// from base_link in the horizontal plane. +inf if a pixel of that bearing looked through the band without a
/// hit, NaN if unknown.
Scan scan_from_depth(const DepthMillimetres& depth, const CameraIntrinsics& camera,
                     const Transform<Map, Base>& T_map_base,
                     const Transform<Map, DepthOptical>& T_map_optical, const DepthScanOptions& options,
                     SensorTime stamp);

}  // namespace parhelion::tools
