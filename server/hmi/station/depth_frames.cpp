#include "server/hmi/station/depth_frames.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include "server/hmi/station/byte_writer.hpp"

namespace parhelion {
namespace {

constexpr std::size_t header_bytes = 16, point_bytes = 16;
constexpr std::uint8_t red = 110, green = 200, blue = 250;

/// m, optical frame.
std::vector<Eigen::Vector3d> points_of(const DepthPixels& pixels, const DepthCameraDescription& camera,
                                       std::size_t most) {
  const CameraIntrinsics& lens = camera.intrinsics;
  const double share = static_cast<double>(pixels.millimetres.size()) / static_cast<double>(most);
  const int stride = std::max(1, static_cast<int>(std::ceil(std::sqrt(share))));
  std::vector<Eigen::Vector3d> points;
  for (int v = stride / 2; v < pixels.height; v += stride) {
    for (int u = stride / 2; u < pixels.width; u += stride) {
      const double depth = 1e-3 * pixels.millimetres[static_cast<std::size_t>(v * pixels.width + u)];
      if (depth == 0 || depth < camera.range_min || depth > camera.range_max || points.size() == most)
        continue;
      points.emplace_back((u - lens.cx) / lens.fx * depth, (v - lens.cy) / lens.fy * depth, depth);
    }
  }
  return points;
}

}  // namespace

std::string depth_bytes(const DepthPixels& pixels, const DepthCameraDescription& camera,
                        const Transform<Map, DepthOptical>& T_map_optical, double t, std::size_t most) {
  const auto points = points_of(pixels, camera, most);
  ByteWriter bytes(header_bytes + point_bytes * points.size());
  bytes.put(std::uint8_t{3});
  bytes.put(std::uint8_t{0});  // of the depth camera
  bytes.put(std::uint16_t{0});
  bytes.put(static_cast<std::uint32_t>(points.size()));
  bytes.put(t);
  const auto T = T_map_optical.isometry();
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d q = T * p;
    for (const double coordinate : {q.x(), q.y(), q.z()}) bytes.put(static_cast<float>(coordinate));
    for (const std::uint8_t part : {red, green, blue, std::uint8_t{0}}) bytes.put(part);
  }
  return bytes.take();
}

}  // namespace parhelion
