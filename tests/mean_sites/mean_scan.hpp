// What devices of several kinds would have measured of a site.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "tests/mean_sites/mean_site.hpp"

namespace parhelion::test {

enum class Device : std::uint8_t {
  terrestrial,  ///< rays in all directions from a tripod, 3 to 6 mm of noise
  drifting,     ///< 10 to 20 mm of noise, each scan up to 2 cm and 0.2 degrees off
  unplaced,     ///< as terrestrial; where the scanners stood is not known
  voxels_5cm,   ///< the centres of occupied cubes, nothing else
  voxels_10cm,
  depth_camera,  ///< 16 frames of 128 x 96 pixels, 0.4 to 4.5 m, noise grows with the range
  sweeps,        ///< a tilted line of beams at each place: 15 mm of noise, mixed pixels, scans off by 3 cm
  warped_camera  ///< as the depth camera; ranges are wrong by a percent or two, poses drift by 2 to 5 cm
};
inline constexpr int kDevices = 8;

inline const char* to_string(Device device) {
  constexpr const char* names[] = {"terrestrial",  "drifting",     "unplaced", "voxels 5 cm",
                                   "voxels 10 cm", "depth camera", "sweeps",   "warped camera"};
  return names[static_cast<std::size_t>(device)];
}

/// In `MeanScan::box`: somebody who walked by.
inline constexpr std::uint16_t kNobody = 0xFFFF;

struct MeanScan {
  cloud::PointCloud<Cloud> cloud;
  std::vector<std::uint16_t> box;      ///< per point: the site's box that it was measured on
  Transform<Cloud, Map> T_cloud_site;  ///< turned about z, and by a degree about a level axis
};

MeanScan mean_scan(const MeanSite& site, Device device, std::uint64_t seed);

}  // namespace parhelion::test
