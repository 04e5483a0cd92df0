// Images of ring_building() with walls, floor and ceiling of a solid texture, from a camera on a driving
// base.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "protocols/image.hpp"
#include "tests/fusion/pose/room.hpp"

namespace parhelion::test {

/// Smooth noise of one octave, 0 to 1: random values on a grid, interpolated.
inline double solid_noise(double x, double y, double z) {
  const auto value = [](std::int64_t i, std::int64_t j, std::int64_t k) {
    auto h = static_cast<std::uint64_t>(i) * 0x9E3779B97F4A7C15U +
             static_cast<std::uint64_t>(j) * 0xC2B2AE3D27D4EB4FU +
             static_cast<std::uint64_t>(k) * 0x165667B19E3779F9U;
    h = (h ^ (h >> 29)) * 0xBF58476D1CE4E5B9U;
    return static_cast<double>((h ^ (h >> 32)) & 0xFFFFU) / 65535.0;
  };
  const double fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
  const auto i = static_cast<std::int64_t>(fx), j = static_cast<std::int64_t>(fy),
             k = static_cast<std::int64_t>(fz);
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int a = corner & 1, b = (corner >> 1) & 1, c = corner >> 2;
    const double wx = a != 0 ? x - fx : 1 - x + fx, wy = b != 0 ? y - fy : 1 - y + fy,
                 wz = c != 0 ? z - fz : 1 - z + fz;
    sum += wx * wy * wz * value(i + a, j + b, k + c);
  }
  return sum;
}

/// Level, looks `yaw` rad to the left of the base's x axis.
inline CameraDescription level_camera(double yaw) {
  CameraDescription camera;
  CameraIntrinsics& lens = camera.intrinsics;
  lens.width = 320;
  lens.height = 240;
  lens.fx = lens.fy = 160 / std::tan(37.5 * std::numbers::pi / 180);
  lens.cx = 159.5;
  lens.cy = 119.5;
  Eigen::Matrix3d R_base_optical;
  R_base_optical.col(2) = Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0);
  R_base_optical.col(1) = Eigen::Vector3d(0, 0, -1);
  R_base_optical.col(0) = R_base_optical.col(1).cross(R_base_optical.col(2));
  camera.T_base_optical = {Eigen::Quaterniond(R_base_optical), {0.2, 0.05, 0.8}};
  return camera;
}

/// Of a level camera.
inline Image textured_image(const CameraDescription& camera, const Pose2& T_map_base, SensorTime stamp,
                            std::mt19937& random) {
  static const std::vector<Segment> walls = ring_building();
  constexpr double ceiling = 2.6, pixel_noise = 2;  // m, digital numbers
  const CameraIntrinsics& lens = camera.intrinsics;
  const Eigen::Vector3d place = camera.T_base_optical.translation();
  const Eigen::Vector2d eye = T_map_base * Eigen::Vector2d(place.head<2>());
  const Eigen::Vector3d ahead = camera.T_base_optical.quaternion() * Eigen::Vector3d::UnitZ();
  const double yaw = T_map_base.yaw + std::atan2(ahead.y(), ahead.x());
  std::normal_distribution<float> noise(0, pixel_noise);
  Image image{stamp, lens.width, lens.height, lens.width, PixelFormat::gray, {}, {}};
  image.bytes.resize(static_cast<std::size_t>(lens.width) * static_cast<std::size_t>(lens.height));
  for (int u = 0; u < lens.width; ++u) {
    const double aside = (u - lens.cx) / lens.fx, azimuth = yaw - std::atan(aside);
    const double to_wall = cast(walls, eye, azimuth);
    for (int v = 0; v < lens.height; ++v) {
      const double slope = (lens.cy - v) / lens.fy / std::sqrt(1 + aside * aside);  // height per distance
      double distance = to_wall, z = place.z() + slope * to_wall;
      if (z < 0) distance = -place.z() / slope, z = 0;
      if (z > ceiling) distance = (ceiling - place.z()) / slope, z = ceiling;
      const double x = eye.x() + distance * std::cos(azimuth), y = eye.y() + distance * std::sin(azimuth);
      const double gray =
          60 + 90 * solid_noise(5 * x, 5 * y, 5 * z) + 70 * solid_noise(13 * x, 13 * y, 13 * z);
      image.bytes[static_cast<std::size_t>(v * lens.width + u)] =
          static_cast<std::uint8_t>(std::clamp(gray + static_cast<double>(noise(random)), 0.0, 255.0));
    }
  }
  return image;
}

}  // namespace parhelion::test
