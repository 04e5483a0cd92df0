// Which part of each drawn pixel a depth image occludes. Private to this module's sources.
//
// The rule, for a drawn pixel p of depth z_p:
// 1. Registration. Each measured depth pixel is transformed to the colour camera and covers the square of its
// own footprint there; the nearest wins.
// 2. Without a measurement the depth of the model or the scan is used, if there is one.
// 3. Confidence. Depth edges jitter from frame to frame and lie off the colour edges, and block matching
// enlarges near objects by some pixels: close to a jump, a near depth has low confidence and a far one a
// higher confidence (a visible gap is real).
// 4. Decision: the fraction of the neighbourhood that lies behind z_p - tolerance, weighted by confidence,
// proximity and colour similarity (a joint bilateral filter, Petschnigg et al. 2004 and Kopf et al. 2007, of
// the occlusion rather than of depth, so that no intermediate depth between two surfaces arises). The colour
// image locates the edge: this keeps the slats of a chair sharp, without a rim, and stable from frame to
// frame.
// 5. Holes. A structured-light or stereo camera has holes beside near edges (where one of its two views is
// occluded), in narrow gaps, and on dark or shiny surfaces: some belong to the near side and some to the far
// one, which geometry alone cannot decide. A pixel without depth, or close to a jump, therefore also uses
// similar pixels further out along eight rays. A pixel without similar or surrounding pixels is not occluded.
#pragma once

#include <cstdint>
#include <vector>

#include "protocols/image.hpp"
#include "render/camera_model.hpp"
#include "render/depth_image.hpp"
#include "render/layer_renderer.hpp"

namespace parhelion::render {

/// Constants of the rule above; the reference implementation in the tests uses the same.
struct DepthRule {
  static constexpr int kRadius = 6;      ///< px, neighbourhood of the decision, sampled every second pixel
  static constexpr int kEdgeRadius = 3;  ///< px, offset of a depth edge
  static constexpr int kReach = 64;      ///< px, search radius for pixels similar to a hole
  static constexpr double kSpatialSigma = 2.2;  ///< px
  static constexpr double kColourSigma = 14;    ///< of 255, over the three channels together
  static constexpr double kMeasured = 1, kNearEdge = 0.03, kFarEdge = 0.4, kModelled = 0.5;
  /// Weight of a pixel at a distance of d px from a hole: kAsked * exp(-d / kAskedRange).
  static constexpr double kAsked = 0.3, kAskedRange = 32;
  static constexpr int kAskedSteps[] = {8, 12, 16, 24, 32, 48, 64};
  static constexpr double kUnlike = 1e-4;                   ///< minimum weight of a pixel of another colour
  static constexpr double kNothing = 1e6;                   ///< m, where the depth is unknown
  static constexpr double kSoftLow = 0.3, kSoftHigh = 0.7;  ///< fraction behind, mapped to coverage
  /// m: noise of a structured-light camera grows with the square of range (Khoshelham and Elberink 2012);
  /// registration and floor height are accurate to a few centimetres.
  static constexpr double tolerance(double z) { return 0.03 + 0.005 * z * z; }
  /// m: a larger difference of depths within kEdgeRadius is an edge; a floor at a grazing angle is not.
  static constexpr double jump(double z) { return 0.02 + 0.04 * z; }
};

struct DepthView {
  const DepthPixels& depth;
  const CameraProjection& depth_camera;
  const DepthCameraDescription& description;  ///< range_min, range_max
  const Transform<Map, DepthOptical>& T_map_depth;
  const CameraProjection& camera;
  const Transform<Map, CameraOptical>& T_map_optical;
  double floor_z;                        ///< m, map; height of the plane of shadows
  const std::vector<std::uint8_t>& bgr;  ///< the camera's pixels, the guide
  const Layer& modelled;                 ///< depth of model and scan over the drawn part
};

/// Reuses its buffers from frame to frame.
class DepthOcclusion {
 public:
  /// Removes the occluded part from the layer's coverage; a pixel without coverage also loses its entity id.
  void apply(const DepthView& view, Layer& layer);

 private:
  void register_depth(const DepthView& view);
  /// Lowers the depth to z (m) within `half` pixels of `pixel`, which may lie outside of the window.
  void put_depth(const Eigen::Vector2d& pixel, double half, double z);
  void add_model(const Layer& modelled);
  void find_edges();
  void find_bounds();
  double visible_fraction(const DepthView& view, int x, int y, float threshold) const;
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y - window_.y0) * static_cast<std::size_t>(window_.width()) +
           static_cast<std::size_t>(x - window_.x0);
  }

  PixelRect window_;
  std::vector<float> depth_, confidence_, nearest_, farthest_;
};

}  // namespace parhelion::render
