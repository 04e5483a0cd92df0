// Checks and refines the transform between colour and depth camera with the images themselves.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "protocols/image.hpp"
#include "tools/import/image_files.hpp"

namespace parhelion::tools {

/// Depth edges of some frames, and the colour gradients that should coincide with them.
class DepthRegistration {
 public:
  void add(const DepthMillimetres& depth, const CameraIntrinsics& depth_camera, const GreyPixels& colour);
  /// Mean colour gradient at the depth edges: high if the images are aligned; 0: no edges.
  double score(const CameraIntrinsics& colour_camera, const Eigen::Isometry3d& T_colour_depth) const;
  /// Rotates the stated transform (or the stated translation without rotation, if that fits better) by up to
  /// about a degree to maximize the score (coordinate descent from 0.4 to 0.025 degrees). Translations are
  /// kept, because at one distance they cannot be distinguished from rotations.
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
