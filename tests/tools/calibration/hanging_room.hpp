// Depth images of ring_building(), of which all but the outer walls hang above the floor.
#pragma once

#include <cmath>
#include <cstdint>

#include "protocols/image.hpp"
#include "render/depth_image.hpp"
#include "tests/fusion/pose/room.hpp"

namespace parhelion::test {

/// Of a level camera. `low`, `high`: m above the floor, of the surfaces that hang.
inline render::DepthPixels hanging_depth(const CameraDescription& camera, const Pose2& T_map_base, double low,
                                         double high) {
  static const std::vector<Segment> walls = ring_building();
  static const std::vector<Segment> outer(walls.begin(), walls.begin() + 4),
      hanging(walls.begin() + 4, walls.end());
  const CameraIntrinsics& lens = camera.intrinsics;
  const Eigen::Vector3d place = camera.T_base_optical.translation();
  const Eigen::Vector2d eye = T_map_base * Eigen::Vector2d(place.head<2>());
  render::DepthPixels image{lens.width, lens.height, {}};
  image.millimetres.resize(static_cast<std::size_t>(lens.width) * static_cast<std::size_t>(lens.height));
  for (int u = 0; u < lens.width; ++u) {
    const double aside = (u - lens.cx) / lens.fx, azimuth = T_map_base.yaw - std::atan(aside);
    const double to_wall = cast(outer, eye, azimuth), to_thing = cast(hanging, eye, azimuth);
    for (int v = 0; v < lens.height; ++v) {
      const double slope = (lens.cy - v) / lens.fy / std::sqrt(1 + aside * aside);  // height per distance
      const double z = place.z() + slope * to_thing;
      double distance = to_thing < to_wall && z > low && z < high ? to_thing : to_wall;
      if (slope < 0) distance = std::min(distance, -place.z() / slope);
      const double depth = distance / std::sqrt(1 + aside * aside);
      image.millimetres[static_cast<std::size_t>(v * lens.width + u)] =
          static_cast<std::uint16_t>(std::lround(1e3 * depth));
    }
  }
  return image;
}

}  // namespace parhelion::test
