// What a depth camera makes of true depths. Private to this room.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "protocols/image.hpp"
#include "render/depth_image.hpp"

namespace parhelion::render {

/// Farthest depth of a camera that says none, m.
inline constexpr double kDepthSight = 60;

double farthest_depth(const DepthCameraDescription& camera);  ///< m, along the optical axis

/// A camera with a baseline measures the disparity between two views, which its noise and its steps are of,
/// so that both grow with the square of the depth (Khoshelham, Elberink, Sensors 2012); and where the second
/// view is hidden by something nearer it measures nothing: left of an edge there is a shadow. The noise of
/// one without is the same at all ranges. What comes out of its ranges is 0. A value depends on (seed, image,
/// its place) and the true depths of its row alone.
class DepthSensor {
 public:
  /// `depths`: m along the optical axis, row by row, infinity where there is nothing.
  void measure(const DepthCameraDescription& camera, std::span<const float> depths, std::uint64_t seed,
               std::uint64_t image, DepthPixels& pixels);

 private:
  std::vector<float> disparities_;  // px, of a row
  std::vector<bool> hidden_;        // of a row, from the second view
};

}  // namespace parhelion::render
