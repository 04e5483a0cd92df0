// Which part of each drawn pixel a depth image hides. Private to this room's sources.
//
// The rule, for a drawn pixel p of depth z_p:
//  1. Registration. Each measured depth pixel is moved to the colour camera and covers the square that its
//  own footprint
//     has there; the nearest wins.
//  2. Where nothing is measured the model or the scan stand in, if they have something there.
//  3. Confidence. Depth edges jitter from frame to frame and lie off the colour's edges, and block matching
//  makes near
//     things fatter by some pixels: near a jump a near depth says little, a far one more (a gap that was seen
//     is one).
//  4. Decision: the share of the neighbourhood that lies behind z_p - tolerance, weighted by confidence,
//  nearness and
//     likeness of colour (a joint bilateral filter, Petschnigg et al. 2004 and Kopf et al. 2007, of the
//     occlusion rather than of depth, so that no depth between two surfaces is made up). The colour image
//     says where an edge really is: that is what keeps the slats of a chair sharp, without a rim, and still
//     from frame to frame.
//  5. Holes. A structured-light or stereo camera has holes beside near edges (the background there is in the
//  shadow of one
//     of its two eyes), through narrow gaps, and on what is dark or shiny: some belong to the near side and
//     some to the far one, and no rule of geometry tells which. So a pixel without depth, or near a jump,
//     also asks pixels further out, along eight rays, that look like it. What nothing resembles and nothing
//     surrounds is not hidden.
#pragma once

#include <cstdint>
#include <vector>

#include "protocols/image.hpp"
#include "render/camera_model.hpp"
#include "render/depth_image.hpp"
#include "render/layer_renderer.hpp"

namespace parhelion::render {

/// The numbers of the rule above; the slow twin in the tests uses the same.
struct DepthRule {
  static constexpr int kRadius = 6;      ///< px, neighbourhood of the decision, sampled every second pixel
  static constexpr int kEdgeRadius = 3;  ///< px, how far a depth edge is off
  static constexpr int kReach = 64;      ///< px, how far a hole asks for its like
  static constexpr double kSpatialSigma = 2.2;  ///< px
  static constexpr double kColourSigma = 14;    ///< of 255, over the three channels together
  static constexpr double kMeasured = 1, kNearEdge = 0.03, kFarEdge = 0.4, kModelled = 0.5;
  /// Weight of a pixel that a hole asks at a distance of d px: kAsked * exp(-d / kAskedRange).
  static constexpr double kAsked = 0.3, kAskedRange = 32;
  static constexpr int kAskedSteps[] = {8, 12, 16, 24, 32, 48, 64};
  static constexpr double kUnlike = 1e-4;  ///< weight that is left to a pixel of another colour
  static constexpr double kNothing = 1e6;  ///< m, where no depth is known
  static constexpr double kSoftLow = 0.3, kSoftHigh = 0.7;  ///< share behind, to coverage
  /// m: noise of a structured-light camera grows with the square of range (Khoshelham and Elberink 2012), and
  /// registration and floor height are known to a few centimetres.
  static constexpr double tolerance(double z) { return 0.03 + 0.005 * z * z; }
  /// m: depths further apart within kEdgeRadius are an edge; a floor seen at a grazing angle is not.
  static constexpr double jump(double z) { return 0.02 + 0.04 * z; }
};

struct DepthView {
  const DepthPixels& depth;
  const CameraProjection& depth_camera;
  const DepthCameraDescription& description;  ///< range_min, range_max
  const Transform<Map, DepthOptical>& T_map_depth;
  const CameraProjection& camera;
  const Transform<Map, CameraOptical>& T_map_optical;
  double floor_z;                        ///< m, map; where shadows lie
  const std::vector<std::uint8_t>& bgr;  ///< the camera's pixels, the guide
  const Layer& modelled;                 ///< depth of model and scan over the drawn part
};

/// Keeps its buffers from frame to frame.
class DepthOcclusion {
 public:
  /// Takes from the layer's coverage what the depth image hides; a pixel without coverage loses its identity
  /// too.
  void apply(const DepthView& view, Layer& layer);

 private:
  void register_depth(const DepthView& view);
  void add_model(const Layer& modelled);
  void find_edges();
  void find_bounds();
  double visible_share(const DepthView& view, int x, int y, float threshold) const;
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y - window_.y0) * static_cast<std::size_t>(window_.width()) +
           static_cast<std::size_t>(x - window_.x0);
  }

  PixelRect window_;
  std::vector<float> depth_, confidence_, nearest_, farthest_;
};

}  // namespace parhelion::render
