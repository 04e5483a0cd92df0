// Ground truth of what is in front of a pixel of the kitchen: not from the frame's own depth image, which the
// occlusion uses, but from other frames, taken from other positions, where those agree.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "render/depth_image.hpp"
#include "tests/render/kitchen.hpp"
#include "tests/render/reference.hpp"

namespace parhelion::test {

/// m, for each pixel of a colour image: the nearest depth measured in another frame; kMiss: none.
inline std::vector<float> depth_of_other_frame(const Kitchen& kitchen, const render::RenderJob& job,
                                               int other) {
  const render::RenderJob from = kitchen.job(other, {});
  const render::DepthPixels depth = render::decode_depth(*from.depth).value();
  const CameraIntrinsics &colour = job.camera.intrinsics, &c = from.depth_camera.intrinsics;
  const auto T_optical_depth = (job.T_map_optical.inverse() * from.T_map_depth).isometry();
  const Eigen::Matrix3d R = T_optical_depth.rotation();
  const Eigen::Vector3d t = T_optical_depth.translation();
  std::vector<float> nearest(static_cast<std::size_t>(colour.width * colour.height),
                             static_cast<float>(kMiss));
  for (int v = 0; v < depth.height; ++v) {
    for (int u = 0; u < depth.width; ++u) {
      const double z = 0.001 * depth.millimetres[static_cast<std::size_t>(v * depth.width + u)];
      if (z < from.depth_camera.range_min || z > from.depth_camera.range_max) continue;
      const Eigen::Vector3d p = R * Eigen::Vector3d((u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z) + t;
      if (p.z() < 0.3) continue;
      const int x = static_cast<int>(std::lround(colour.cx + colour.fx * p.x() / p.z())),
                y = static_cast<int>(std::lround(colour.cy + colour.fy * p.y() / p.z()));
      if (x < 0 || y < 0 || x >= colour.width || y >= colour.height) continue;
      float& at = nearest[static_cast<std::size_t>(y * colour.width + x)];
      at = std::min(at, static_cast<float>(p.z()));
    }
  }
  return nearest;
}

enum class Seen : std::uint8_t { unknown, hidden, visible };

/// Whether something real is in front of the bodies of `reference`. Unknown where fewer than three other
/// frames measured there, where they disagree, where the real object is nearer than `margin` to the body, and
/// close to such pixels.
inline std::vector<Seen> seen_by_others(const Kitchen& kitchen, const render::RenderJob& job,
                                        const ReferenceRendering& reference, const std::vector<int>& others,
                                        double margin) {
  constexpr int kBeside = 2;  // px; frames are aligned within that at an edge
  std::vector<std::vector<float>> depths;
  for (const int other : others) depths.push_back(depth_of_other_frame(kitchen, job, other));
  std::vector<Seen> of_pixel(reference.body_z.size(), Seen::unknown), result = of_pixel;
  for (std::size_t i = 0; i < of_pixel.size(); ++i) {
    if (reference.body_z[i] == kMiss) continue;
    int nearer = 0, farther = 0, measured = 0;
    for (const std::vector<float>& depth : depths) {
      if (depth[i] == static_cast<float>(kMiss)) continue;
      ++measured;
      nearer += depth[i] < reference.body_z[i] - margin;
      farther += depth[i] > reference.body_z[i] + margin;
    }
    if (measured >= 3 && nearer == measured) of_pixel[i] = Seen::hidden;
    if (measured >= 3 && farther == measured) of_pixel[i] = Seen::visible;
  }
  for (int y = kBeside; y < reference.height - kBeside; ++y) {
    for (int x = kBeside; x < reference.width - kBeside; ++x) {
      const Seen seen = of_pixel[reference.at(x, y)];
      bool alike = true;
      for (int dy = -kBeside; dy <= kBeside && alike; ++dy)
        for (int dx = -kBeside; dx <= kBeside; ++dx) alike &= of_pixel[reference.at(x + dx, y + dy)] == seen;
      if (alike) result[reference.at(x, y)] = seen;
    }
  }
  return result;
}

}  // namespace parhelion::test
