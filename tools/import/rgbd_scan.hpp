// A planar scan cut out of a depth image: not a laser's, and marked so.
#pragma once

#include "protocols/image.hpp"
#include "protocols/scan.hpp"
#include "tools/import/image_files.hpp"

namespace parhelion::tools {

struct DepthScanOptions {
  double low = 0.2, high = 0.5;                      ///< m over the floor
  double step = 0.5 * 3.14159265358979323846 / 180;  ///< rad between beams
};

/// What every scan of this camera looks like: centred on base_link's x axis, in the middle of the band.
LaserDescription describe_depth_scan(const CameraIntrinsics& camera, const DepthScanOptions& options);

/// For each bearing the nearest point of the band (the fifth nearest, against single flying pixels), seen
/// from base_link, in the horizontal plane. +inf where a pixel of that bearing was seen through the band, NaN
/// where nothing is known.
Scan cut_scan(const DepthMillimetres& depth, const CameraIntrinsics& camera,
              const Transform<Map, Base>& T_map_base, const Transform<Map, DepthOptical>& T_map_optical,
              const DepthScanOptions& options, SensorTime stamp);

}  // namespace parhelion::tools
