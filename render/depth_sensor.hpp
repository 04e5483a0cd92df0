// Model of a depth camera: converts true depths to measured ones. Private to this module.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "protocols/image.hpp"
#include "render/depth_image.hpp"

namespace parhelion::render {

/// m, farthest depth of a camera whose description gives none.
inline constexpr double kDepthSight = 60;

double farthest_depth(const DepthCameraDescription& camera);  ///< m, along the optical axis

/// A camera with a baseline measures the disparity between two views. Its noise and steps are constant in
/// disparity, so both grow with the square of the depth (Khoshelham, Elberink, Sensors 2012), and there is no
/// measurement where the second view is occluded, which leaves a shadow left of an edge. Without a baseline
/// the noise is constant at all ranges. Values outside of its range become 0. A value depends only on (seed,
/// image, its position) and the true depths of its row.
class DepthSensor {
 public:
  /// `depths`: m along the optical axis, row by row; infinity: no surface.
  void measure(const DepthCameraDescription& camera, std::span<const float> depths, std::uint64_t seed,
               std::uint64_t image, DepthPixels& pixels);

 private:
  std::vector<float> disparities_;  // px, of a row
  std::vector<bool> hidden_;        // of a row, occluded in the second view
};

}  // namespace parhelion::render
