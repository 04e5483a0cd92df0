#include "fusion/pose/slam_front_end.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace parhelion::pose {
namespace {

/// Below this fraction of explained points a match is unreliable.
constexpr double kMinExplained = 0.3;
/// 1 sigma, m: beyond this a pose from odometry alone counts as lost.
constexpr double kLostSigma = 0.5;

}  // namespace

Eigen::Matrix3d odometry_covariance(const RobotDescription& robot, double driven, double turned) {
  // Wider than the description, with lower bounds: if the filter trusted a systematic error (a bent axis, a
  // wrong wheel), each match would lag by a little, and the map built from them would bend.
  const double position = 4 * robot.odometry_error_translation * driven + 0.002;
  const double yaw = 4 * robot.odometry_error_rotation * turned + 0.5 * driven + 0.005;
  return Eigen::Vector3d(position * position, position * position, yaw * yaw).asDiagonal();
}

Eigen::Matrix3d propagated_covariance(const Eigen::Matrix3d& covariance, const Pose2& before,
                                      const Pose2& after, const Eigen::Matrix3d& step_covariance) {
  Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
  F(0, 2) = -(after.y - before.y);
  F(1, 2) = after.x - before.x;
  return F * covariance * F.transpose() + step_covariance;
}

SlamFrontEnd::SlamFrontEnd(const RobotDescription& robot, const Options& options)
    : robot_(robot), options_(options), fine_(options.cell), coarse_(4 * options.cell) {}

SlamFrontEnd::Estimate SlamFrontEnd::add(const ScanPoints& scan, const Pose2& step) {
  const bool first = keyframes_.empty();
  Estimate estimate;
  if (first) {
    if (!scan.points.empty()) keep(scan);
  } else {
    const double driven = step.position().norm(), turned = std::abs(step.yaw);
    driven_ += driven;
    turned_ += turned;
    const Pose2 expected = pose_ * step;
    const Eigen::Matrix3d predicted =
        propagated_covariance(covariance_, pose_, expected, odometry_covariance(robot_, driven, turned));
    const Match found =
        match_from_several(fine_, coarse_, scan.points, expected, predicted.inverse(), options_.match);
    estimate.explained = found.explained;
    if (found.explained >= kMinExplained) {
      pose_ = found.T_map_base;
      covariance_ = (predicted.inverse() + found.information).inverse();
    } else {
      pose_ = expected;
      covariance_ = predicted;
    }
    estimate.lost = std::sqrt(std::max(covariance_(0, 0), covariance_(1, 1))) > kLostSigma;
    const bool moved_on = driven_ - driven_at_keyframe_ >= options_.keyframe_distance ||
                          turned_ - turned_at_keyframe_ >= options_.keyframe_angle;
    if (moved_on && found.explained >= 0.5 * kMinExplained) keep(scan), estimate.keyframe = true;
  }
  ++scans_;
  estimate.T_map_base = pose_;
  estimate.covariance = covariance_;
  return estimate;
}

void SlamFrontEnd::keep(const ScanPoints& scan) {
  Keyframe keyframe{scan, pose_, Eigen::Matrix3d::Zero(), driven_, scans_};
  if (!keyframes_.empty()) {
    const Eigen::Matrix3d step =
        odometry_covariance(robot_, driven_ - driven_at_keyframe_, turned_ - turned_at_keyframe_);
    keyframe.step_information = (0.25 * step).inverse();
  }
  driven_at_keyframe_ = driven_;
  turned_at_keyframe_ = turned_;
  fine_.add(scan.points, pose_);
  coarse_.add(scan.points, pose_);
  keyframes_.push_back(std::move(keyframe));
  while (driven_ - keyframes_[oldest_in_map_].driven > options_.window) {
    const Keyframe& old = keyframes_[oldest_in_map_++];
    fine_.add(old.scan.points, old.T_map_base, -1);
    coarse_.add(old.scan.points, old.T_map_base, -1);
  }
}

}  // namespace parhelion::pose
