// A scan that is kept in the map.
#pragma once

#include <cstddef>
#include <vector>

#include "fusion/pose/mapping/wall_directions.hpp"
#include "fusion/pose/matching/scan_points.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// The part of a motion that only odometry measured, m: as it was tracked, and as odometry reported it,
/// without a scale that was learned.
struct WeakMotion {
  Eigen::Vector2d tracked = Eigen::Vector2d::Zero(), reported = Eigen::Vector2d::Zero();
};

struct Keyframe {
  ScanPoints scan;
  Pose2 T_map_base;  ///< as estimated by the front end, or as optimised
  Pose2 step;        ///< motion since the previous keyframe as the front end tracked it
  /// Of that, in the frame of the previous keyframe: what odometry knows, and what its scan showed.
  Eigen::Matrix3d step_information = Eigen::Matrix3d::Zero();
  /// Covariance of its pose in the map, by matches: x, y, yaw.
  Eigen::Matrix3d drift = Eigen::Matrix3d::Zero();
  /// Error of the pose by that of odometry's scale, 1 sigma, over the way that only odometry measured; m, map
  /// frame.
  Eigen::Vector2d unseen = Eigen::Vector2d::Zero();
  WeakMotion weak_motion;        ///< of `step`, in the frame of the previous keyframe
  double driven = 0;             ///< m, path length up to here
  std::size_t scan_index = 0;    ///< number of the scan
  double explained = 1;          ///< fraction of its points, by the path before it
  std::vector<WallPiece> walls;  ///< that its scan saw
};

}  // namespace parhelion::pose
