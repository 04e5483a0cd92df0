// Which part of each drawn pixel a depth image hides. Private to this room's sources.
//
// The rule, for a drawn pixel p of depth z_p:
//  1. Registration. Each measured depth pixel is moved to the colour camera and covers the square that its
//  own footprint
//     has there; the nearest wins.
//  2. Holes take the depth of the model or the scan where these have something; else the farther of the
//  nearest depths to
//     the left and right in the row. Farther, because a structured-light or stereo camera has its holes
//     beside a near edge, where the background is in the shadow of one of its two eyes; along the row,
//     because the eyes are side by side. Where a row has none, nothing hides.
//  3. Confidence. Depth edges jitter by two pixels from frame to frame and lie off the colour's edges: within
//  two pixels of
//     a jump a depth counts little, a filled one little too.
//  4. Decision: the share of the neighbourhood that lies behind z_p - tolerance, weighted by confidence,
//  nearness and
//     likeness of colour (a joint bilateral filter, Petschnigg et al. 2004 and Kopf et al. 2007, of the
//     occlusion rather than of depth, so that no depth between two surfaces is made up). The colour image
//     says where an edge really is: that is what keeps the slats of a chair sharp, without a rim, and still
//     from frame to frame.
#pragma once

#include <cstdint>
#include <vector>

#include "protocols/image.hpp"
#include "render/camera_model.hpp"
#include "render/depth_image.hpp"
#include "render/layer_renderer.hpp"

namespace parhelion {

/// The numbers of the rule above; the slow twin in the tests uses the same.
struct DepthRule {
  static constexpr int kRadius = 6;      ///< px, neighbourhood of the decision, sampled every second pixel
  static constexpr int kEdgeRadius = 2;  ///< px, how far a depth edge jitters
  static constexpr int kReach = 64;      ///< px beside the drawn part that a hole's sides are looked for
  static constexpr double kSpatialSigma = 2.2;  ///< px
  static constexpr double kColourSigma = 14;    ///< of 255, over the three channels together
  static constexpr double kMeasured = 1, kEdge = 0.05, kModelled = 0.5, kFilled = 0.1, kUnknown = 0.02;
  static constexpr double kNothing = 1e6;                   ///< m, where no depth is known
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
  void fill_rows();
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

}  // namespace parhelion
