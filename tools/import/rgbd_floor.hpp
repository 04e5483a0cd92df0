// Which way is up and where the floor is, from depth frames at known poses.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/status.hpp"
#include "tools/import/image_files.hpp"

namespace parhelion::tools {

/// A depth pixel in the camera's optical frame; z is what depth measures.
inline Eigen::Vector3d depth_point(const CameraIntrinsics& camera, int column, int row, double z) {
  return {(column - camera.cx) / camera.fx * z, (row - camera.cy) / camera.fy * z, z};
}

/// Surface points of many frames in the folder's world, with the normal that each one's neighbours give it.
class SurfacePoints {
 public:
  void add(const DepthMillimetres& depth, const CameraIntrinsics& camera,
           const Eigen::Isometry3d& T_world_depth);
  bool empty() const { return points_.empty(); }

  /// Mean of the normals that lie within 12 degrees of it, from a first guess on (mean shift), which need be
  /// right to 40 degrees only; nullopt: too few surfaces face that way.
  std::optional<Eigen::Vector3d> refine_up(const Eigen::Vector3d& guess) const;

  struct Floor {
    Eigen::Vector3d up;  ///< unit normal of the floor
    double height;       ///< m, of the floor along `up`, from the world's origin
    double leveled;      ///< rad, between `up` and what was given
  };
  /// The lowest layer of level surface that holds at least 3 % as many points as the densest one (a table
  /// often is denser than the floor under it), and a plane through it by least squares where it is more than
  /// half a metre wide and leans by less than 5 degrees. nullopt: no layer.
  std::optional<Floor> find_floor(const Eigen::Vector3d& up) const;

 private:
  std::optional<double> lowest_layer(const Eigen::Vector3d& up) const;
  std::vector<Eigen::Vector3d> points_, normals_;
};

}  // namespace parhelion::tools
