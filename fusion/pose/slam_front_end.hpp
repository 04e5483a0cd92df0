// The SLAM front end: each scan is matched to the surfels of the recent path, with odometry as prior.
#pragma once

#include <cstddef>
#include <vector>

#include "fusion/pose/scan_match.hpp"
#include "fusion/pose/scan_points.hpp"
#include "fusion/pose/surfel_map.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

struct Keyframe {
  ScanPoints scan;
  Pose2 T_map_base;  ///< as estimated by the front end, or as optimised
  Eigen::Matrix3d step_information =
      Eigen::Matrix3d::Zero();  ///< of the motion since the previous keyframe, in its frame
  double driven = 0;            ///< m, path length up to here
  std::size_t scan_index = 0;   ///< number of the scan
};

/// Odometry error over a motion: covariance of x, y, yaw in the frame of its end.
Eigen::Matrix3d odometry_covariance(const RobotDescription& robot, double driven, double turned);
/// The covariance of a pose, propagated over the motion `step`; both in the map frame.
Eigen::Matrix3d propagated_covariance(const Eigen::Matrix3d& covariance, const Pose2& before,
                                      const Pose2& after, const Eigen::Matrix3d& step_covariance);

class SlamFrontEnd {
 public:
  struct Options {
    double cell = 0.1;                ///< m
    double keyframe_distance = 0.15;  ///< m
    double keyframe_angle = 0.1;      ///< rad
    double window = 25;               ///< m of path that the local map covers
    MatchOptions match;
  };
  struct Estimate {
    Pose2 T_map_base;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< map frame
    double explained = 0;
    bool lost = false;
    bool keyframe = false;
  };

  SlamFrontEnd(const RobotDescription& robot, const Options& options);

  /// `step`: odometry since the previous scan; the first scan is at `start`.
  Estimate add(const ScanPoints& scan, const Pose2& step);
  void set_start(const Pose2& start) { pose_ = start; }
  const std::vector<Keyframe>& keyframes() const { return keyframes_; }
  std::vector<Keyframe> take_keyframes() { return std::move(keyframes_); }

 private:
  void keep(const ScanPoints& scan);

  RobotDescription robot_;
  Options options_;
  SurfelMap fine_, coarse_;
  std::vector<Keyframe> keyframes_;
  std::size_t oldest_in_map_ = 0;
  Pose2 pose_;
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
  double driven_ = 0, turned_ = 0;
  double driven_at_keyframe_ = 0, turned_at_keyframe_ = 0;
  std::size_t scans_ = 0;
};

}  // namespace parhelion::pose
