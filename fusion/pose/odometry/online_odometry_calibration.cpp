#include "fusion/pose/odometry/online_odometry_calibration.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/pose/odometry/odometry_correction.hpp"

namespace parhelion::pose {
namespace {

constexpr std::size_t kScans = 64;              ///< that may wait for odometry: a second of a fast laser
constexpr double kStep = 0.24, kLongest = 0.6;  ///< s
/// s: over such a time on both sides odometry's step is derived for its time offset.
constexpr double kHalf = 0.03;
/// m and rad per step: less is standing still, whatever the noise of a match says.
constexpr double kMinMoved = 0.01, kMinTurned = 0.01;
/// m and rad: matches that are less certain come from the prediction, and would confirm odometry by itself.
constexpr double kMaxSigma = 0.03, kMaxYawSigma = 0.01;
/// m and rad, of a match, at least: the map is not perfect.
constexpr double kMatchSigma = 0.003, kMatchYawSigma = 0.001;
/// At first: s, and of the scales. Then per square root of a second of motion. Chosen on the generated drives
/// of online_odometry_calibration_test.cpp: an offset that drifts by 0.05 s in two minutes is followed to
/// 0.01 s.
constexpr double kFirstOffset = 0.1, kFirstScale = 0.05;
constexpr double kOffsetWalk = 0.002, kScaleWalk = 0.0005;
constexpr double kFirstJitter = 0.02;  ///< s
constexpr int kEnoughSteps = 20;
constexpr double kJitterMemory = 50;               ///< steps
constexpr double kTail = 2.4, kUnexplained = 2.5;  ///< sigma
constexpr double kMaxSlew = 0.02;                  ///< of the time that passes

constexpr double squared(double x) { return x * x; }

/// 1 sigma along the robot's x axis.
double variance_along(const Pose2& pose, const Eigen::Matrix3d& covariance) {
  const Eigen::Vector2d along(std::cos(pose.yaw), std::sin(pose.yaw));
  return along.dot(covariance.topLeftCorner<2, 2>() * along);
}

}  // namespace

OnlineOdometryCalibration::OnlineOdometryCalibration()
    : odometry_(seconds(3.0), milliseconds(300)), scans_(kScans), x_(Eigen::Vector3d::Zero()) {
  P_ = Eigen::Vector3d(squared(kFirstOffset), squared(kFirstScale), squared(kFirstScale)).asDiagonal();
  jitter_.setConstant(squared(kFirstJitter));
}

void OnlineOdometryCalibration::forget_motion() {
  scans_.clear();
  waiting_ = 0;
  before_.reset();
}

void OnlineOdometryCalibration::add(const Odometry& odometry) {
  if (odometry_.add(odometry) == OdometryTrack::Added::restarted) forget_motion();
  use_waiting_scans();
}

void OnlineOdometryCalibration::add(SensorTime stamp, const Pose2& T_map_base,
                                    const Eigen::Matrix3d& covariance) {
  scans_.push({stamp, T_map_base, covariance});
  waiting_ = std::min(waiting_ + 1, kScans);
  use_waiting_scans();
}

bool OnlineOdometryCalibration::is_covered(SensorTime stamp) const {
  return !odometry_.empty() && odometry_.newest_stamp() >= stamp + seconds(kHalf - x_[0]);
}

void OnlineOdometryCalibration::use_waiting_scans() {
  for (; waiting_ > 0 && is_covered(scans_.newest(waiting_ - 1).stamp); --waiting_) {
    const MatchedScan& scan = scans_.newest(waiting_ - 1);
    const double passed = before_ ? (scan.stamp - before_->stamp).seconds() : kLongest + 1;
    if (passed >= 0 && passed < kStep) continue;
    if (passed >= kStep && passed <= kLongest) {
      if (const auto step = step_between(*before_, scan)) use(*step);
    }
    before_ = scan;
  }
}

std::optional<Eigen::Vector2d> OnlineOdometryCalibration::odometry_step(SensorTime a, SensorTime b,
                                                                        double offset) const {
  const auto from = odometry_.at(a - seconds(offset)), to = odometry_.at(b - seconds(offset));
  if (!from || !to || to->ahead > 0) return std::nullopt;
  const Twist2 step = twist_to(from->T_odom_base.inverse() * to->T_odom_base);
  return Eigen::Vector2d(step.vx, step.wz);
}

std::optional<OnlineOdometryCalibration::Step> OnlineOdometryCalibration::step_between(
    const MatchedScan& a, const MatchedScan& b) const {
  const auto odometry = odometry_step(a.stamp, b.stamp, x_[0]);
  const auto earlier = odometry_step(a.stamp, b.stamp, x_[0] - kHalf);
  const auto later = odometry_step(a.stamp, b.stamp, x_[0] + kHalf);
  if (!odometry || !earlier || !later) return std::nullopt;
  const Twist2 scans = twist_to(a.T_map_base.inverse() * b.T_map_base);
  Step step;
  step.seconds = (b.stamp - a.stamp).seconds();
  step.scans = {scans.vx, scans.wz};
  step.scans_variance = {variance_along(a.T_map_base, a.covariance) +
                             variance_along(b.T_map_base, b.covariance) + squared(kMatchSigma),
                         a.covariance(2, 2) + b.covariance(2, 2) + squared(kMatchYawSigma)};
  step.odometry = *odometry;
  step.by_offset = (*later - *earlier) / (2 * kHalf);
  return step;
}

void OnlineOdometryCalibration::use(const Step& step) {
  const Eigen::Vector2d moved = step.odometry.cwiseAbs().cwiseMax(step.scans.cwiseAbs());
  if (moved.x() < kMinMoved && moved.y() < kMinTurned) return;
  steps_ = std::min(steps_ + 1, kEnoughSteps);
  P_.diagonal() +=
      step.seconds * Eigen::Vector3d(squared(kOffsetWalk), squared(kScaleWalk), squared(kScaleWalk));
  P_(0, 0) = std::min(P_(0, 0), squared(kFirstOffset));
  if (step.scans_variance.x() < squared(kMaxSigma)) use_axis(step, 0);
  if (step.scans_variance.y() < squared(kMaxYawSigma)) use_axis(step, 1);
  x_[0] = std::clamp(x_[0], -kMaxOffset, kMaxOffset);
  x_.tail<2>() = x_.tail<2>().cwiseMax(-kMaxScale).cwiseMin(kMaxScale);
}

void OnlineOdometryCalibration::use_axis(const Step& step, int axis) {
  const double scale = 1 + x_[1 + axis], odometry = step.odometry[axis];
  const double innovation = step.scans[axis] - scale * odometry;
  Eigen::Vector3d h = Eigen::Vector3d::Zero();
  h[0] = scale * step.by_offset[axis];
  h[1 + axis] = odometry;
  const double speed = std::max(std::abs(odometry), std::abs(step.scans[axis])) / step.seconds;
  const double noise = step.scans_variance[axis] + jitter_[axis] * squared(speed);
  const double bound = (kMaxScale + std::abs(x_[1 + axis])) * std::abs(odometry) +
                       (kMaxOffset + std::abs(x_[0])) * std::abs(h[0]);
  if (std::abs(innovation) > bound + kUnexplained * std::sqrt(noise)) return;
  const Eigen::Vector3d Ph = P_ * h;
  const double variance = h.dot(Ph) + noise;
  // Cauchy's weight: as if the noise of an outlier were larger.
  const double weighted = h.dot(Ph) + noise * (1 + squared(innovation) / (squared(kTail) * variance));
  x_ += Ph * (innovation / weighted);
  P_ -= Ph * Ph.transpose() / weighted;
  const double min_moved = axis == 0 ? kMinMoved : kMinTurned;
  if (speed * step.seconds < 2 * min_moved) return;
  const double left = (squared(innovation) - h.dot(Ph) - step.scans_variance[axis]) / squared(speed);
  jitter_[axis] += (std::clamp(left, 0.0, 9 * jitter_[axis] + 1e-6) - jitter_[axis]) / kJitterMemory;
}

double OnlineOdometryCalibration::jitter() const {
  return steps_ < kEnoughSteps ? 0 : std::sqrt(jitter_.maxCoeff());
}

OdometryCorrection OnlineOdometryCalibration::estimate() const {
  OdometryCorrection correction;
  correction.time_offset = x_[0];
  correction.translation_scale = 1 + x_[1];
  correction.rotation_scale = 1 + x_[2];
  return correction;
}

Odometry FollowedCorrection::operator()(const Odometry& odometry, const OdometryCorrection& estimate) {
  const Pose2 raw = planar(odometry.T_odom_base);
  if (!raw.finite()) return odometry;
  unchanged_ = unchanged_ && estimate == OdometryCorrection{};
  if (unchanged_) {
    last_ = Last{odometry.stamp, raw, raw};
    return odometry;
  }
  Pose2 corrected = raw;
  if (last_) {
    const double passed = std::max(0.0, (odometry.stamp - last_->stamp).seconds());
    const double change = kMaxSlew * std::min(passed, 1.0);
    offset_ += std::clamp(estimate.time_offset - offset_, -change, change);
    corrected = last_->corrected * corrected_step(estimate, last_->raw.inverse() * raw);
  }
  last_ = Last{odometry.stamp, raw, corrected};
  return {odometry.stamp + seconds(offset_), transform<Odom, Base>(corrected)};
}

}  // namespace parhelion::pose
