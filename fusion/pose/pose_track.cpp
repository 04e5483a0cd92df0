#include "fusion/pose/pose_track.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace parhelion::pose {
namespace {

constexpr std::size_t kEstimateSlots = 256;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

double angle_between(const Transform<Map, Base>& a, const Transform<Map, Base>& b) {
  return a.quaternion().angularDistance(b.quaternion());
}

double position_sigma(const PoseCovariance& covariance) {
  const Eigen::Matrix2d planar = covariance.topLeftCorner<2, 2>();
  return std::sqrt(
      std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(planar).eigenvalues().maxCoeff()));
}

/// Propagates the covariance of a pose over a motion `d_map` with the uncertain heading before it.
PoseCovariance propagated(const PoseCovariance& covariance, const Eigen::Vector3d& d_map) {
  PoseCovariance F = PoseCovariance::Identity();
  F.topRightCorner<3, 3>() = -cross_matrix(d_map);
  return F * covariance * F.transpose();
}

double ratio(Duration part, Duration whole) {
  return static_cast<double>(part.ns) / static_cast<double>(whole.ns);
}

NoPose reason(OdometryTrack::Missing missing) {
  switch (missing) {
    case OdometryTrack::Missing::none_there:
      return NoPose::no_odometry;
    case OdometryTrack::Missing::older_than_history:
      return NoPose::older_than_history;
    case OdometryTrack::Missing::too_far_ahead:
      return NoPose::too_far_ahead;
  }
  return NoPose::no_odometry;
}

}  // namespace

const char* to_string(NoPose why) {
  switch (why) {
    case NoPose::no_odometry:
      return "no odometry at that instant";
    case NoPose::no_slam:
      return "no pose from SLAM yet";
    case NoPose::slam_lost:
      return "SLAM is lost";
    case NoPose::relocalizing:
      return "relocalizing";
    case NoPose::older_than_history:
      return "older than the history of poses";
    case NoPose::too_far_ahead:
      return "too far ahead of the last odometry";
    case NoPose::map_mismatch:
      return "SLAM's map is not the model's";
  }
  return "unknown";
}

PoseTrack::PoseTrack(const RobotDescription& robot, const PoseTrackOptions& options)
    : robot_(robot),
      options_(options),
      corrected_(robot.odometry),
      odometry_(options.history, options.max_extrapolation),
      odometry_drift_(robot),
      estimates_(kEstimateSlots) {}

void PoseTrack::add(const Odometry& odometry) {
  const OdometryTrack::Taken taken = odometry_.add(corrected_(odometry));
  if (taken != OdometryTrack::Taken::yes) ++rejected_;
  if (taken == OdometryTrack::Taken::restarted) {
    estimates_.clear();
    T_map_odom_.reset();
    odometry_drift_.forget();
    provisional_ = lost_ = relocalizing_ = false;
  }
  if (provisional_) align_odometry(estimates_.newest());
}

PoseTrack::Correction PoseTrack::add(const PoseEstimate& estimate) {
  if (!estimate.causal || !estimate.T_map_base.finite() || !estimate.covariance.allFinite()) {
    ++rejected_;
    return Correction::ignored;
  }
  if (estimates_.count() > 0 && estimate.stamp <= estimates_.newest().stamp) {
    ++rejected_;
    if (estimates_.newest().stamp - estimate.stamp <= options_.history) return Correction::ignored;
    // The history is cleared only where odometry confirms that the clock restarted.
    if (!odometry_.empty() && odometry_.newest_stamp() - estimate.stamp > options_.history)
      return Correction::ignored;
    estimates_.clear();
    T_map_odom_.reset();
  }
  mismatch_ = !options_.map_id.empty() && estimate.map_id != options_.map_id;
  if (mismatch_) return Correction::ignored;
  if (estimate.state != SlamState::tracking) {
    lost_ = estimate.state == SlamState::lost || estimates_.count() > 0;
    return Correction::ignored;
  }

  EstimateSample sample{estimate.stamp, estimate.T_map_base, estimate.covariance};
  const bool known = estimates_.count() > 0;
  if (known) {
    const Transform<Map, Base> expected = expected_pose(estimate.stamp);
    sample.jumped = (expected.translation() - estimate.T_map_base.translation()).norm() >
                        options_.relocalization_distance ||
                    angle_between(expected, estimate.T_map_base) > options_.relocalization_angle;
    learn(sample, expected);
  }
  if (!align_odometry(sample)) {
    ++rejected_;
    return Correction::ignored;
  }
  estimates_.push(sample);
  lost_ = false;
  if (!known) return Correction::first;
  if (sample.jumped) {
    relocalizing_ = true;
    return Correction::relocalization;
  }
  if (position_sigma(estimate.covariance) <= options_.recovered_sigma) relocalizing_ = false;
  return Correction::small;
}

void PoseTrack::learn(const EstimateSample& estimate, const Transform<Map, Base>& expected) {
  if (!T_map_odom_ || provisional_) return;
  const auto odometry = odometry_.at(estimate.stamp);
  if (!odometry || odometry->ahead > 0) return;
  const Pose2 there = planar(expected), here = planar(estimate.T_map_base);
  const PoseCovariance own = estimates_.newest().covariance + estimate.covariance;
  // A jump is a relocalization: odometry drift is updated only by the largest step that counts as a
  // correction.
  odometry_drift_.learn(
      {.driven = std::abs(odometry->driven - at_correction_.driven),
       .turned = std::abs(odometry->turned - at_correction_.turned),
       .distance = std::min((here.position() - there.position()).norm(), options_.relocalization_distance),
       .angle = std::min(angle_between(expected, estimate.T_map_base), options_.relocalization_angle),
       .position_variance = (own(0, 0) + own(1, 1)) / 2,
       .yaw_variance = own(5, 5)});
}

bool PoseTrack::align_odometry(const EstimateSample& estimate) {
  provisional_ = false;
  if (odometry_.empty()) return true;
  const auto odometry = odometry_.at(estimate.stamp);
  if (!odometry) return false;
  at_correction_ = *odometry;
  provisional_ = odometry->ahead > 0;
  T_map_odom_ = estimate.T_map_base * transform<Odom, Base>(odometry->T_odom_base).inverse();
  return true;
}

PoseCovariance PoseTrack::extrapolation_growth(double dt) const {
  // The twist may change as fast as the robot can brake: three sigma of its acceleration.
  const RobotLimits& limits = robot_.limits;
  const double position = 0.5 * limits.deceleration / 3 * dt * dt;
  const double yaw = limits.speed > 0 ? position * limits.yaw_rate / limits.speed : 0;
  PoseCovariance growth = PoseCovariance::Zero();
  growth.topLeftCorner<2, 2>().diagonal().setConstant(position * position);
  growth(5, 5) = yaw * yaw;
  return growth;
}

std::optional<PoseAtInstant> PoseTrack::from_odometry(SensorTime t, NoPose& why) const {
  OdometryTrack::Missing missing{};
  const auto odometry = odometry_.at(t, &missing);
  if (!odometry) {
    why = reason(missing);
    return std::nullopt;
  }
  if (!T_map_odom_) {
    why = NoPose::no_slam;
    return std::nullopt;
  }
  const EstimateSample& estimate = estimates_.newest();
  PoseAtInstant pose;
  pose.T_map_base = *T_map_odom_ * transform<Odom, Base>(odometry->T_odom_base);
  const double driven = std::abs(odometry->driven - at_correction_.driven);
  const double turned = std::abs(odometry->turned - at_correction_.turned);
  const double position_variance = odometry_drift_.position_variance(driven);
  // The heading error is applied at the start, so that it affects the whole path since the SLAM estimate.
  PoseCovariance covariance = estimate.covariance;
  covariance(5, 5) += odometry_drift_.yaw_variance(driven, turned);
  covariance = propagated(covariance, pose.T_map_base.translation() - estimate.T_map_base.translation());
  covariance(0, 0) += position_variance;
  covariance(1, 1) += position_variance;
  pose.covariance = covariance + extrapolation_growth(odometry->ahead);
  pose.age = t - estimate.stamp;
  pose.twist = odometry->twist;
  return pose;
}

std::optional<PoseAtInstant> PoseTrack::from_estimates(SensorTime t, NoPose& why) const {
  const EstimateSample& last = estimates_.newest();
  if (t < last.stamp - options_.history) {
    why = NoPose::older_than_history;
    return std::nullopt;
  }
  const std::size_t age = estimates_.age_at(t);
  if (age == estimates_.count()) {
    why = NoPose::no_slam;
    return std::nullopt;
  }
  if (age == 0 && t - last.stamp > options_.max_extrapolation) {
    why = NoPose::too_far_ahead;
    return std::nullopt;
  }
  // The pair that encloses t, or the last pair beyond it.
  const std::size_t end = age == 0 ? 0 : age - 1;
  const EstimateSample& b = estimates_.newest(end);
  PoseAtInstant pose;
  pose.T_map_base = b.T_map_base;
  pose.covariance = b.covariance;
  pose.age = t - last.stamp;
  const double ahead = std::max(0.0, (t - last.stamp).seconds());
  const bool pair = end + 1 < estimates_.count() && !b.jumped &&
                    b.stamp - estimates_.newest(end + 1).stamp <= options_.max_extrapolation;
  if (!pair) {
    if (t < b.stamp) {
      why = b.jumped ? NoPose::relocalizing : NoPose::no_slam;
      return std::nullopt;
    }
    // A single estimate contains no motion: the robot may move within its limits.
    const double reach = robot_.limits.speed * ahead, turn = robot_.limits.yaw_rate * ahead;
    pose.covariance.topLeftCorner<2, 2>().diagonal().array() += reach * reach;
    pose.covariance(5, 5) += turn * turn;
    return pose;
  }
  const EstimateSample& a = estimates_.newest(end + 1);
  const double s = ratio(t - a.stamp, b.stamp - a.stamp);
  pose.T_map_base = interpolate(a.T_map_base, b.T_map_base, s);
  pose.covariance = s <= 1 ? PoseCovariance((1 - s) * a.covariance + s * b.covariance)
                           : PoseCovariance(b.covariance + (s - 1) * (s - 1) * (a.covariance + b.covariance) +
                                            extrapolation_growth(ahead));
  pose.twist = twist_between(planar(a.T_map_base), planar(b.T_map_base), (b.stamp - a.stamp).seconds());
  return pose;
}

std::optional<PoseAtInstant> PoseTrack::predict(SensorTime t, NoPose& why) const {
  if (!odometry_.empty()) return from_odometry(t, why);
  if (estimates_.count() > 0) return from_estimates(t, why);
  why = NoPose::no_slam;
  return std::nullopt;
}

Transform<Map, Base> PoseTrack::expected_pose(SensorTime t) const {
  NoPose why{};
  if (T_map_odom_) {
    if (const auto pose = from_odometry(t, why)) return pose->T_map_base;
  } else if (const auto pose = from_estimates(t, why)) {
    return pose->T_map_base;
  }
  return estimates_.newest().T_map_base;
}

std::optional<PoseAtInstant> PoseTrack::at(SensorTime t, NoPose* why) const {
  NoPose no_pose = NoPose::no_slam;
  std::optional<PoseAtInstant> pose;
  if (mismatch_) {
    no_pose = NoPose::map_mismatch;
  } else if (lost_) {
    no_pose = NoPose::slam_lost;
  } else if (relocalizing_) {
    no_pose = NoPose::relocalizing;
  } else {
    pose = predict(t, no_pose);
  }
  if (!pose && why != nullptr) *why = no_pose;
  return pose;
}

double predicted_error(const PoseAtInstant& pose, const Eigen::Vector3d& p_map) {
  const Eigen::Vector3d r = p_map - pose.T_map_base.translation();
  Eigen::Matrix<double, 2, 3> J;
  J << 1, 0, -r.y(), 0, 1, r.x();
  constexpr int planar_rows[] = {0, 1, 5};
  const Eigen::Matrix3d planar_covariance = pose.covariance(planar_rows, planar_rows);
  const Eigen::Matrix2d at_place = J * planar_covariance * J.transpose();
  return std::sqrt(
      std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(at_place).eigenvalues().maxCoeff()));
}

}  // namespace parhelion::pose
