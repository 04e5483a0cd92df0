// How the colour camera stands to the depth camera, checked against the images themselves.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "protocols/image.hpp"
#include "tools/import/image_files.hpp"

namespace parhelion::tools {

/// Depth edges of some frames and the colour gradients that they should lie on.
class DepthRegistration {
 public:
  void add(const DepthMillimetres& depth, const CameraIntrinsics& depth_camera, const GreyPixels& colour);
  /// Mean colour gradient under the depth edges: high where the two images lie on each other; 0: no edges.
  double score(const CameraIntrinsics& colour_camera, const Eigen::Isometry3d& T_colour_depth) const;
  /// Turns the stated transform, or the stated translation without rotation where that fits better, by up to
  /// about a degree to where edges fit best (coordinate descent from 0.4 to 0.025 degrees). Translations are
  /// kept: they can't be told from rotations at one distance.
  Eigen::Isometry3d refine(const CameraIntrinsics& colour_camera,
                           const Eigen::Isometry3d& T_colour_depth) const;

 private:
  struct Frame {
    std::vector<Eigen::Vector3d> edges;  ///< m, depth camera's optical frame, on the nearer side
    int width = 0, height = 0;
    std::vector<float> gradient;
  };
  std::vector<Frame> frames_;
};

}  // namespace parhelion::tools
