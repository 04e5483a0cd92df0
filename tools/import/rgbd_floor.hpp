// Estimates the up direction and the floor from depth frames with known poses.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/status.hpp"
#include "tools/import/image_files.hpp"

namespace parhelion::tools {

/// A depth pixel in the camera's optical frame; depth is the z coordinate.
inline Eigen::Vector3d depth_point(const CameraIntrinsics& camera, int column, int row, double z) {
  return {(column - camera.cx) / camera.fx * z, (row - camera.cy) / camera.fy * z, z};
}

/// Surface points of many frames in the folder's world frame, with normals estimated from their neighbours.
class SurfacePoints {
 public:
  void add(const DepthMillimetres& depth, const CameraIntrinsics& camera,
           const Eigen::Isometry3d& T_world_depth);
  bool empty() const { return points_.empty(); }

  /// Mean shift: mean of the normals within 12 degrees of the estimate, from a first guess that is correct to
  /// 40 degrees; nullopt: too few surfaces face that way.
  std::optional<Eigen::Vector3d> refine_up(const Eigen::Vector3d& guess) const;

  struct Floor {
    Eigen::Vector3d up;  ///< unit normal of the floor
    double height;       ///< m, of the floor along `up`, from the world's origin
    double leveled;      ///< rad, between `up` and the given direction
  };
  /// The lowest level surface with at least 3 % as many points as the densest one (a table is often denser
  /// than the floor under it), with a least-squares plane through it if it is wider than half a metre and
  /// inclined by less than 5 degrees. nullopt: no such surface.
  std::optional<Floor> find_floor(const Eigen::Vector3d& up) const;

 private:
  std::optional<double> lowest_layer(const Eigen::Vector3d& up) const;
  std::vector<Eigen::Vector3d> points_, normals_;
};

}  // namespace parhelion::tools
