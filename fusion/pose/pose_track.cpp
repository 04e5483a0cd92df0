#include "fusion/pose/pose_track.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "fusion/pose/mapping/slam_front_end.hpp"

namespace parhelion::pose {
namespace {

constexpr std::size_t kEstimateSlots = 256;
constexpr double kMaxChi2 = 16.3;     ///< 99.9 % of three degrees of freedom
constexpr double kLessCertain = 2;    ///< sigma to sigma, of a match that SLAM's estimate replaces
constexpr int kPlanar[] = {0, 1, 5};  ///< x, y, yaw

constexpr double kMoved = 0.1, kTurned = 0.1;  ///< m and rad by odometry: more than a standing robot's noise

/// s after a scan's stamp, in which the scan's twist gives way to odometry's: longer than a sweep, shorter
/// than the time to the next scan, whose innovation has to show what odometry alone predicts.
constexpr double kTwistLife = 0.06;

/// Over eight times the jitter of its stamps a twist is known to some 18 %.
Duration twist_span(double jitter) { return seconds(std::clamp(8 * jitter, 0.04, 0.4)); }

constexpr double squared(double x) { return x * x; }

Twist2 difference(const Twist2& a, const Twist2& b) { return {a.vx - b.vx, a.vy - b.vy, a.wz - b.wz}; }

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
    case NoPose::slam_silent:
      return "no estimate from SLAM while the robot moved";
    case NoPose::jumping:
      return "localization jumps";
  }
  return "unknown";
}

PoseTrack::PoseTrack(const RobotDescription& robot, const PoseTrackOptions& options)
    : robot_(robot),
      options_(options),
      corrected_(robot.odometry),
      odometry_(options.history, options.max_extrapolation),
      odometry_drift_(robot),
      estimates_(kEstimateSlots),
      refinements_(kEstimateSlots) {}

void PoseTrack::add(const Odometry& odometry) {
  const Odometry as_described = corrected_(odometry);
  calibration_.add(as_described);
  odometry_.set_twist_span(twist_span(calibration_.jitter()));
  const OdometryTrack::Added added = odometry_.add(followed_(as_described, calibration_.estimate()));
  if (added != OdometryTrack::Added::accepted) ++rejected_;
  if (added == OdometryTrack::Added::restarted) {
    restart();
    odometry_drift_.forget();
    lost_ = relocalizing_ = false;
  }
  if (anchor_ && anchor_->provisional) take_odometry_at_anchor();
  measure_silent_motion();
}

void PoseTrack::measure_silent_motion() {
  if (!odometry_at_estimate_ && estimates_.count() > 0 && !odometry_.empty()) {
    // Odometry came after the estimate, or has a gap there.
    auto then = odometry_.at(estimates_.newest().stamp);
    if (!then) then = odometry_.at(odometry_.newest_stamp());
    if (then) odometry_at_estimate_ = then->T_odom_base;
  }
  if (!odometry_at_estimate_) return;
  const auto newest = odometry_.at(odometry_.newest_stamp());
  if (!newest) return;
  const Pose2 moved = odometry_at_estimate_->inverse() * newest->T_odom_base;
  silent_distance_ = std::max(silent_distance_, moved.position().norm());
  silent_angle_ = std::max(silent_angle_, std::abs(moved.yaw));
  const bool moves = silent_distance_ > kMoved || silent_angle_ > kTurned;
  if (moves && !moves_since_) moves_since_ = odometry_.newest_stamp();
}

std::optional<PoseTrack::Silence> PoseTrack::silence(SensorTime t) const {
  if (!odometry_at_estimate_ || estimates_.count() == 0) return std::nullopt;
  const Silence now{t - estimates_.newest().stamp, silent_distance_, silent_angle_};
  const bool moved = now.distance > options_.silent_distance || now.angle > options_.silent_angle;
  return moved && t - *moves_since_ > options_.max_silence ? std::optional(now) : std::nullopt;
}

void PoseTrack::restart() {
  odometry_at_estimate_.reset();
  moves_since_.reset();
  silent_distance_ = silent_angle_ = 0;
  last_jump_.reset();
  jump_before_.reset();
  jumping_ = false;
  estimates_.clear();
  refinements_.clear();
  scan_motion_.forget();
  calibration_.forget_motion();
  anchor_.reset();
  previous_anchor_.reset();
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
    restart();
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
  }
  if (!agrees_with_scans(sample)) {
    const Pose2 before = planar(T_map_odom_);
    if (!anchor(sample)) {
      ++rejected_;
      return Correction::ignored;
    }
    scan_motion_.correct(planar(T_map_odom_) * before.inverse());
  }
  estimates_.push(sample);
  const auto odometry = odometry_.at(estimate.stamp);
  odometry_at_estimate_ = odometry ? std::optional(odometry->T_odom_base) : std::nullopt;
  moves_since_.reset();
  silent_distance_ = silent_angle_ = 0;
  measure_silent_motion();
  lost_ = false;
  if (!known) return Correction::first;
  if (sample.jumped) {
    relocalizing_ = true;
    // Without odometry each turn is a jump.
    if (!odometry_.empty()) note_jump(estimate.stamp);
    return jumping_ ? Correction::jump : Correction::relocalization;
  }
  if (jumping_ && estimate.stamp - *last_jump_ >= options_.steady_after) jumping_ = false;
  if (position_sigma(estimate.covariance) <= options_.recovered_sigma) relocalizing_ = false;
  return Correction::small;
}

void PoseTrack::note_jump(SensorTime stamp) {
  if (jump_before_ && stamp - *jump_before_ <= options_.jumps_within) jumping_ = true;
  jump_before_ = std::exchange(last_jump_, stamp);
}

const PoseTrack::EstimateSample* PoseTrack::refinement_at(SensorTime stamp) const {
  const std::size_t age = refinements_.age_at(stamp);
  if (age == refinements_.count() || refinements_.newest(age).stamp != stamp) return nullptr;
  return &refinements_.newest(age);
}

/// SLAM's estimate is older than the newest matched scan and made from the same scans: where it agrees, it
/// says nothing new, unless the match was the less certain one, as along a corridor.
bool PoseTrack::agrees_with_scans(const EstimateSample& estimate) const {
  const EstimateSample* refinement = refinement_at(estimate.stamp);
  if (refinement == nullptr || estimate.jumped) return false;
  const Pose2 a = planar(refinement->T_map_base), b = planar(estimate.T_map_base);
  const Eigen::Vector3d off(b.x - a.x, b.y - a.y, wrap_angle(b.yaw - a.yaw));
  if (position_sigma(refinement->covariance) > kLessCertain * position_sigma(estimate.covariance))
    return false;
  const Eigen::Matrix3d covariance = (refinement->covariance + estimate.covariance)(kPlanar, kPlanar);
  return off.dot(covariance.inverse() * off) <= kMaxChi2;
}

bool PoseTrack::anchor(const EstimateSample& correction) {
  if (odometry_.empty()) return true;
  if (!odometry_.at(correction.stamp)) return false;
  previous_anchor_ = anchor_;
  anchor_ = Anchor{correction.stamp, correction.T_map_base, correction.covariance, {}, {}, true};
  return take_odometry_at_anchor();
}

bool PoseTrack::take_odometry_at_anchor() {
  const auto odometry = odometry_.at(anchor_->stamp);
  if (!odometry) return false;
  anchor_->odometry = *odometry;
  anchor_->provisional = odometry->ahead > 0;
  T_map_odom_ = anchor_->T_map_base * transform<Odom, Base>(odometry->T_odom_base).inverse();
  if (!anchor_->provisional) learn_drift();
  return true;
}

/// From what odometry predicted for the anchor from the one before.
void PoseTrack::learn_drift() {
  if (!previous_anchor_ || previous_anchor_->provisional || previous_anchor_->stamp >= anchor_->stamp) return;
  const Anchor& before = *previous_anchor_;
  const Pose2 expected =
      planar(before.T_map_base) * (before.odometry.T_odom_base.inverse() * anchor_->odometry.T_odom_base);
  const Pose2 here = planar(anchor_->T_map_base);
  const PoseCovariance own = before.covariance + anchor_->covariance;
  // A jump is a relocalization: odometry drift is updated only by the largest step that counts as a
  // correction.
  odometry_drift_.learn(
      {.driven = std::abs(anchor_->odometry.driven - before.odometry.driven),
       .turned = std::abs(anchor_->odometry.turned - before.odometry.turned),
       .distance = std::min((here.position() - expected.position()).norm(), options_.relocalization_distance),
       .angle = std::min(std::abs(wrap_angle(here.yaw - expected.yaw)), options_.relocalization_angle),
       .position_variance = (own(0, 0) + own(1, 1)) / 2,
       .yaw_variance = own(5, 5)});
}

std::optional<MatchPrior> PoseTrack::match_prior(SensorTime stamp) const {
  if (!anchor_ || estimates_.count() == 0 || stamp - estimates_.newest().stamp > options_.max_slam_age)
    return std::nullopt;
  const auto pose = at(stamp);
  const auto odometry = odometry_.at(stamp);
  if (!pose || !odometry) return std::nullopt;
  const double driven = std::abs(odometry->driven - anchor_->odometry.driven);
  const double turned = std::abs(odometry->turned - anchor_->odometry.turned);
  const Eigen::Matrix3d known = pose->covariance(kPlanar, kPlanar);
  return MatchPrior{planar(pose->T_map_base),
                    known + odometry_covariance(robot_, driven, turned),
                    pose->twist,
                    {},
                    scan_motion_.last_step()};
}

void PoseTrack::refine(SensorTime stamp, const Pose2& T_map_base, const Eigen::Matrix3d& covariance,
                       const std::optional<Twist2>& twist) {
  const auto carried = at(stamp);
  if (!carried) return;
  // Moved in the plane: height and tilt stay.
  const Pose2 correction = T_map_base * planar(carried->T_map_base).inverse();
  EstimateSample refined{stamp, transform<Map, Map>(correction) * carried->T_map_base, carried->covariance};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) refined.covariance(kPlanar[i], kPlanar[j]) = covariance(i, j);
  }
  if (refinements_.count() > 0 && stamp <= refinements_.newest().stamp) return;
  const auto by_odometry = odometry_.at(stamp);
  const Pose2 predicted = planar(T_map_odom_ * transform<Odom, Base>(by_odometry->T_odom_base));
  scan_motion_.add(stamp, T_map_base, predicted);
  if (options_.calibrate_odometry) calibration_.add(stamp, T_map_base, covariance);
  if (!anchor(refined)) return;
  refinements_.push(refined);
  anchor_->twist = twist;
}

/// What `twist` misses of the motion since the anchor's scan, while that scan's sweep lasts.
Pose2 PoseTrack::motion_in_sweep(SensorTime t, const Twist2& twist) const {
  const double since = (t - anchor_->stamp).seconds();
  if (!anchor_->twist || since <= 0) return {};
  return moved(difference(*anchor_->twist, twist), since * std::exp(-squared(since / kTwistLife)));
}

std::optional<PoseAtInstant> PoseTrack::from_scans(SensorTime t) const {
  if (!scan_motion_.is_preferred() || refinements_.count() == 0 ||
      refinements_.newest().stamp != anchor_->stamp)
    return std::nullopt;
  const auto predicted = scan_motion_.at(t);
  if (!predicted) return std::nullopt;
  const Pose2 T_map_base =
      planar(anchor_->T_map_base) * predicted->step * motion_in_sweep(t, predicted->twist);
  const Pose2 correction = T_map_base * planar(anchor_->T_map_base).inverse();
  PoseAtInstant pose;
  pose.T_map_base = transform<Map, Map>(correction) * anchor_->T_map_base;
  PoseCovariance covariance = anchor_->covariance;
  covariance(5, 5) += predicted->yaw_variance;
  covariance = propagated(covariance, pose.T_map_base.translation() - anchor_->T_map_base.translation());
  covariance(0, 0) += predicted->position_variance;
  covariance(1, 1) += predicted->position_variance;
  pose.covariance = covariance;
  pose.twist = predicted->twist;
  return pose;
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
  if (!anchor_) {
    why = NoPose::no_slam;
    return std::nullopt;
  }
  if (auto pose = from_scans(t)) {
    pose->age = t - estimates_.newest().stamp;
    return pose;
  }
  PoseAtInstant pose;
  pose.T_map_base = T_map_odom_ * transform<Odom, Base>(odometry->T_odom_base *
                                                        motion_in_sweep(t, anchor_->odometry.twist));
  const double driven = std::abs(odometry->driven - anchor_->odometry.driven);
  const double turned = std::abs(odometry->turned - anchor_->odometry.turned);
  const double position_variance = odometry_drift_.position_variance(driven);
  // The heading error is applied at the start, so that it affects the whole path since the correction.
  PoseCovariance covariance = anchor_->covariance;
  covariance(5, 5) += odometry_drift_.yaw_variance(driven, turned);
  covariance = propagated(covariance, pose.T_map_base.translation() - anchor_->T_map_base.translation());
  covariance(0, 0) += position_variance;
  covariance(1, 1) += position_variance;
  pose.covariance = covariance + extrapolation_growth(odometry->ahead);
  pose.age = t - estimates_.newest().stamp;
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
  if (const EstimateSample* refinement = refinement_at(t)) return refinement->T_map_base;
  if (anchor_) {
    if (const auto pose = from_odometry(t, why)) return pose->T_map_base;
  } else if (const auto pose = from_estimates(t, why)) {
    return pose->T_map_base;
  }
  return estimates_.newest().T_map_base;
}

std::optional<Pose2> PoseTrack::odometry_at(SensorTime t) const {
  const auto there = odometry_.at(t);
  return there ? std::optional(there->T_odom_base) : std::nullopt;
}

std::optional<PoseAtInstant> PoseTrack::at(SensorTime t, NoPose* why) const {
  NoPose no_pose = NoPose::no_slam;
  std::optional<PoseAtInstant> pose;
  if (mismatch_) {
    no_pose = NoPose::map_mismatch;
  } else if (lost_) {
    no_pose = NoPose::slam_lost;
  } else if (silence(t)) {
    no_pose = NoPose::slam_silent;
  } else if (jumping_) {
    no_pose = NoPose::jumping;
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
  const Eigen::Matrix3d planar_covariance = pose.covariance(kPlanar, kPlanar);
  const Eigen::Matrix2d at_place = J * planar_covariance * J.transpose();
  // The larger eigenvalue of a symmetric matrix. A covariance that is not a number stays one.
  const double middle = (at_place(0, 0) + at_place(1, 1)) / 2, half = (at_place(0, 0) - at_place(1, 1)) / 2;
  const double largest = middle + std::sqrt(half * half + at_place(0, 1) * at_place(0, 1));
  return std::sqrt(std::max(largest, 0.0));
}

}  // namespace parhelion::pose
