#include "server/station/depth_frames.hpp"

#include <cstdint>
#include <vector>

#include "fusion/cloud/sensor_cloud.hpp"
#include "server/station/byte_writer.hpp"

namespace parhelion::station {
namespace {

constexpr std::size_t kHeaderBytes = 16, kPointBytes = 16;

/// The smallest step that gives at most `max_points` points.
int step_for(const render::DepthPixels& pixels, std::size_t max_points) {
  for (int step = 1;; ++step) {
    const auto of = [step](int length) { return static_cast<std::size_t>((length + step - 1) / step); };
    if (of(pixels.width) * of(pixels.height) <= max_points) return step;
  }
}

/// m, optical frame.
std::vector<Eigen::Vector3f> points_of(const render::DepthPixels& pixels,
                                       const DepthCameraDescription& camera, std::size_t max_points) {
  if (pixels.width != camera.intrinsics.width) return {};
  cloud::DepthCloudOptions options;
  options.step = step_for(pixels, max_points);
  options.range_min = camera.range_min;
  if (camera.range_max > 0) options.range_max = camera.range_max;
  auto cloud = cloud::cloud_from_depth(pixels.millimetres, camera.intrinsics, options);
  return cloud ? std::move(cloud->points) : std::vector<Eigen::Vector3f>();
}

}  // namespace

std::string depth_bytes(const render::DepthPixels& pixels, const DepthCameraDescription& camera,
                        const Transform<Map, DepthOptical>& T_map_optical, double t, std::size_t max_points) {
  const auto points = points_of(pixels, camera, max_points);
  ByteWriter bytes(kHeaderBytes + kPointBytes * points.size());
  bytes.put(std::uint8_t{3});
  bytes.put(std::uint8_t{0});   // of the depth camera
  bytes.put(std::uint16_t{0});  // without colours
  bytes.put(static_cast<std::uint32_t>(points.size()));
  bytes.put(t);
  const auto T = T_map_optical.isometry();
  for (const Eigen::Vector3f& p : points) {
    const Eigen::Vector3d q = T * p.cast<double>();
    for (const double coordinate : {q.x(), q.y(), q.z()}) bytes.put(static_cast<float>(coordinate));
    bytes.put(std::uint32_t{0});
  }
  return bytes.take();
}

}  // namespace parhelion::station
