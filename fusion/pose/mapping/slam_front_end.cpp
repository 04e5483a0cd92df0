#include "fusion/pose/mapping/slam_front_end.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>

#include "fusion/pose/matching/scan_change.hpp"
#include "fusion/pose/matching/weak_directions.hpp"

namespace parhelion::pose {
namespace {

/// Below this fraction of explained points a match is unreliable.
constexpr double kMinExplained = 0.3;
/// 1 sigma, m: beyond these a pose counts as unsure and as lost.
constexpr double kUnsureSigma = 0.15, kLostSigma = 0.5;
/// Without a reliable match for so long, it counts as unsure.
constexpr Duration kPatience = milliseconds(500);
/// Drift of a map that is built from its own scans, before loops have shown what it is: 1 sigma over the
/// square root of the path, m and rad per sqrt(m), at least; and per sqrt(m), the part of the sigma of a
/// match. Chosen on 45 generated drives with lasers of five kinds, in tunnels, halls, offices and among
/// shelves.
constexpr double kDrift = 0.002, kYawDrift = 0.0004;
constexpr double kDriftOfMatch = 0.8, kYawDriftOfMatch = 0.35;
/// m, 1 sigma, of a step: odometry's stamps are late by some hundredths of a second, which would bend the
/// map. Chosen on Intel.
constexpr double kMinOdometryError = 0.01;
/// 1 sigma, m and rad: of a place that was found again.
constexpr double kLoopSigma = 0.01, kLoopYawSigma = 0.003;
/// What a match counts in the step to its keyframe: successive ones are made with the same map and share its
/// errors. Chosen on generated tunnels and Intel; 0.02 to 0.4 give much the same maps.
constexpr double kStepByMatch = 0.1;

/// 1 sigma, m and rad: of a robot that was picked up, and of one that was found again.
constexpr double kAwaySigma = 1, kAwayYawSigma = 0.5, kFoundSigma = 0.1, kFoundYawSigma = 0.05;
/// As in the localizer: a robot that is this near to where odometry predicts it (m, rad), by points that
/// determine the pose to this sigma (m), and of which the map explains nearly as many as usual, for so long,
/// was never away.
constexpr double kExact = 0.1, kExactYaw = 0.06, kExactSigma = 0.05, kNearlyUsual = 0.85, kMinFound = 0.4;
constexpr Duration kExactFor = seconds(1.0);
/// Of what the map usually explains: what it explains from a place beside the tracked one where a robot is
/// that nobody has picked up. With less than that, and more than kNearlyUsual, it is unsure. Chosen on SENA
/// with late odometry, on UAL with wheels that spin, and on generated robots put down.
constexpr double kAsUsual = 0.95;

/// m, formal 1 sigma of one scan, as for strong_directions(): the way that scans do not show well, for the
/// ellipse; and the way that they do not show, which gets the scale of odometry. In generated bare corridors
/// it is 0.1 m or more, in offices 0.02 m or less.
constexpr double kShownWell = 0.02, kHardlyShown = 0.05;

/// m, formal 1 sigma of one scan, from which on odometry holds the robot against its matches, which count
/// anew after so many metres. Chosen on Intel and on generated houses with a depth camera's scan (seeds 11 to
/// 14, 31 and 32), yards (6 to 9, 21) and tunnels.
constexpr double kHeldBelow = 0.05, kRenewedAfter = 0.2;

/// rad, 1 sigma, of the direction that scans do not show: it is learned from their own normals.
constexpr double kUnseenDirection = 0.01;

/// Returns that contradict the newest keyframe where the ground is none that the map does not reach.
constexpr double kNotNew = 0.2;

/// Keyframes: with fewer, a robot is not taken for picked up.
constexpr std::size_t kKnowsWhatStands = 5;

/// Points of keyframes that a scan adds to the local map, about: some 0.6 ms. After a loop the map is made
/// anew over some scans.
constexpr std::size_t kPointsAdded = 4000;

constexpr double squared(double x) { return x * x; }

/// Covariance of x, y, yaw; m, rad.
Eigen::Matrix3d diagonal(double sigma, double yaw_sigma) {
  return Eigen::Vector3d(sigma * sigma, sigma * sigma, yaw_sigma * yaw_sigma).asDiagonal();
}

}  // namespace

SlamFrontEnd::SlamFrontEnd(const RobotDescription& robot, const Options& options)
    : robot_(robot),
      options_(options),
      tracking_(
          robot,
          {.min_odometry_error = kMinOdometryError, .growing = true, .has_odometry = options.has_odometry}),
      held_(robot, {kHeldBelow, kRenewedAfter}),
      scale_(robot.odometry_error_translation),
      fine_(options.cell),
      coarse_(4 * options.cell),
      new_ground_(options.cell) {}

SlamFrontEnd::Estimate SlamFrontEnd::add(const ScanPoints& whole_scan, const ScanOdometry::Step& reported) {
  const ScanOdometry::Step step = scale_.applied(reported);
  const ScanPoints scan = without_companions(whole_scan, step);
  Estimate estimate;
  if (!is_map_complete_) update_local_map();
  if (keyframes_.empty()) {
    matched_ = scan.stamp;
    if (!scan.points.empty()) keep(scan, 1);
  } else if (displaced_) {
    wait(whole_scan, step, estimate);
  } else {
    const Pose2 before = pose_;
    estimate.moved = track(scan, step, estimate);
    driven_ += estimate.moved.position().norm();
    turned_ += std::abs(estimate.moved.yaw);
    watch(whole_scan, before, step, estimate);
    learn_scale(scan.stamp);
    estimate.state = state(scan.stamp);
    const bool moved_on = driven_ - driven_at_keyframe_ >= options_.keyframe_distance ||
                          turned_ - turned_at_keyframe_ >= options_.keyframe_angle;
    // Odometry that can be trusted leads over places where scans have little in common with the map.
    const double enough = tracking_.fault() == OdometryFault::none ? 0.5 * kMinExplained : kMinExplained;
    if (moved_on && estimate.explained >= enough && !check_.is_suspected()) {
      keep(scan, estimate.explained);
      straighten();
      estimate.keyframe = true;
    }
    if (is_new_ground(scan, step, estimate.explained)) {
      go_on_in_new_ground(scan);
      estimate.keyframe = true;
    }
  }
  ++scans_;
  estimate.T_map_base = pose_;
  estimate.covariance = tracking_.published(covariance_) + drift_at(pose_);
  return estimate;
}

/// From motion that a fault of odometry does not explain.
void SlamFrontEnd::learn_scale(SensorTime stamp) {
  if (shown_.isZero() || tracking_.is_odometry_suspected())
    scale_.forget_motion();
  else
    scale_.add(stamp, pose_, shown_);
}

/// While odometry can be trusted: it tells them from what stands still.
ScanPoints SlamFrontEnd::without_companions(const ScanPoints& scan, const ScanOdometry::Step& step) {
  if (step.known && tracking_.fault() == OdometryFault::none) return companions_.without(scan, step.step);
  companions_.forget();
  return scan;
}

/// In the local map, of which the keyframes are at hand.
std::optional<Match> SlamFrontEnd::search_surroundings(const ScanPoints& scan, const Pose2& around) const {
  constexpr std::size_t points_of_keyframe = 90;
  constexpr double surroundings = 8;  // m
  constexpr int levels = 5;
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    const Keyframe& keyframe = keyframes_[i];
    if (in_map_[i] == 0 || (keyframe.T_map_base.position() - around.position()).norm() > surroundings)
      continue;
    for (const Eigen::Vector2d& p : thinned(keyframe.scan.points, points_of_keyframe))
      points.push_back(keyframe.T_map_base * p);
  }
  if (points.empty()) return std::nullopt;
  return wide_search(CorrelativeMap(points, options_.cell, levels), fine_, scan.points, around, {},
                     options_.match);
}

/// The motion that is taken for true.
Pose2 SlamFrontEnd::track(const ScanPoints& scan, const ScanOdometry::Step& step, Estimate& estimate) {
  const Pose2 before = pose_;
  const ScanTracking::Maps maps{fine_, coarse_, [this](const ScanPoints& unexplained, const Pose2& around) {
                                  return search_surroundings(unexplained, around);
                                }};
  const auto found = tracking_.follow(maps, scan, {pose_, covariance_}, step, options_.match);
  estimate.explained = found.match.explained;
  if (found.match.explained >= kMinExplained) {
    const Estimate2 now = held_.after({before, covariance_}, found, step.step);
    pose_ = now.T_map_base;
    covariance_ = now.covariance;
    shown_ = found.match.information;
    matched_ = scan.stamp;
  } else {
    shown_.setZero();
    pose_ = found.expected.T_map_base;
    covariance_ = found.expected.covariance;
  }
  is_led_by_odometry_ = found.by_odometry;
  add_weak_motion(before, found, step);
  unseen_ += unmeasured_.add(scan.stamp, pose_, shown_, found.by_odometry, tracking_.speed(), unseen_);
  return found.by_odometry ? step.step : before.inverse() * pose_;
}

/// The way that scans do not show.
void SlamFrontEnd::add_weak_motion(const Pose2& before, const ScanTracking::Followed& found,
                                   const ScanOdometry::Step& step) {
  const auto weak = [&](double sigma) -> Eigen::Matrix2d {
    return Eigen::Matrix2d::Identity() - strong_directions(shown_, sigma).topLeftCorner<2, 2>();
  };
  const Eigen::Vector2d moved = pose_.position() - before.position();
  unseen_ += scale_.tracked_sigma() * (weak(kShownWell) * moved);
  if (!found.by_odometry) return;
  const Eigen::Matrix2d hidden = weak(kHardlyShown);
  weak_motion_.tracked += hidden * moved;
  weak_motion_.reported += hidden * ((before * step.reported).position() - before.position());
}

/// Whether the robot is picked up.
void SlamFrontEnd::watch(const ScanPoints& scan, const Pose2& before, const ScanOdometry::Step& step,
                         Estimate& estimate) {
  const Keyframe& newest = keyframes_.back();
  doubt_.add(scan, before, pose_, step, 1);
  // What is usual was learned in the whole map. And of the first scans alone nobody knows what stands, and
  // what are people.
  if (!is_map_complete_ || keyframes_.size() < kKnowsWhatStands) return;
  const Pose2 T_keyframe_map = newest.T_map_base.inverse();
  check_.add(newest.scan, scan, {T_keyframe_map * pose_, T_keyframe_map * before * step.step},
             estimate.explained);
  if (!check_.is_displaced()) return;
  const auto beside = search_surroundings(scan, pose_);
  const double of_usual = beside ? beside->explained / check_.usually_explained() : 0;
  // Odometry that fails leads a robot astray, too.
  const bool suspected = tracking_.is_odometry_suspected();
  if (of_usual >= (suspected ? kNearlyUsual : kAsUsual)) {
    step_aside(*beside, scan.stamp, estimate);
  } else if (of_usual < kNearlyUsual && !suspected) {
    displaced_ = true;
    exact_since_.reset();
    pose_ = before * step.step;
    covariance_ = diagonal(kAwaySigma, kAwayYawSigma);
    shown_.setZero();
    tracking_.picked_up(scan.stamp);
  }
}

/// To a place beside the tracked one that the scan fits: wheels that slip or odometry that is late have led
/// the robot astray, or it was pushed, but not carried away.
void SlamFrontEnd::step_aside(const Match& beside, SensorTime stamp, Estimate& estimate) {
  new_ground_.forget();
  pose_ = beside.T_map_base;
  covariance_ = diagonal(kFoundSigma, kFoundYawSigma);
  shown_.setZero();
  matched_ = stamp;
  estimate.explained = beside.explained;
  tracking_.continue_from(pose_);
  scale_.forget_motion();
}

/// Until it is found, or was never away.
void SlamFrontEnd::wait(const ScanPoints& scan, const ScanOdometry::Step& step, Estimate& estimate) {
  pose_ = pose_ * step.step;
  estimate.state = SlamState::lost;
  if (!is_undisturbed(scan)) return;
  go_on(pose_, scan.stamp);
  estimate.state = SlamState::unsure;
}

/// The robot is exactly where odometry predicts it, and has been for a while: only something in front of the
/// laser had come or gone. Nobody puts a robot down with this accuracy.
bool SlamFrontEnd::is_undisturbed(const ScanPoints& scan) {
  const Match found = match(fine_, scan.points, pose_, pose_, Eigen::Matrix3d::Zero(), options_.match);
  const Pose2 off = pose_.inverse() * found.T_map_base;
  const Eigen::Matrix3d covariance = (found.information + 1e-3 * Eigen::Matrix3d::Identity()).inverse();
  const bool exact = off.position().norm() < kExact && std::abs(off.yaw) < kExactYaw &&
                     covariance.topLeftCorner<2, 2>().trace() < kExactSigma * kExactSigma &&
                     found.explained >= std::max(kMinFound, kNearlyUsual * check_.usually_explained());
  if (!exact) exact_since_.reset();
  if (exact && !exact_since_) exact_since_ = scan.stamp;
  if (exact) pose_ = found.T_map_base;
  return exact && scan.stamp - *exact_since_ >= kExactFor;
}

/// Odometry alone leads the robot, and nothing says that it is wrong.
bool SlamFrontEnd::is_new_ground(const ScanPoints& scan, const ScanOdometry::Step& step, double explained) {
  const bool led = is_map_complete_ && step.known && is_led_by_odometry_ && !displaced_ &&
                   !check_.is_suspected() && explained < 0.5 * kMinExplained &&
                   !tracking_.is_odometry_suspected();
  const ScanPoints& newest = keyframes_.back().scan;
  if (led && !change_between(newest, scan, keyframes_.back().T_map_base.inverse() * pose_).exceeds(kNotNew))
    return new_ground_.add(scan, pose_, options_.match);
  new_ground_.forget();
  return false;
}

/// The error of the way to here is one of the map from here on. Where it is large the robot is unsure until a
/// loop has shown it.
void SlamFrontEnd::go_on_in_new_ground(const ScanPoints& scan) {
  const Eigen::Matrix3d path_covariance = covariance_;
  came_unmeasured_ =
      came_unmeasured_ || std::sqrt(std::max(path_covariance(0, 0), path_covariance(1, 1))) > kUnsureSigma;
  covariance_ = diagonal(kLoopSigma, kLoopYawSigma);
  broken_at_ = keyframes_.size();
  keep(scan, 1);
  keyframes_.back().drift += path_covariance;
  matched_ = scan.stamp;
  heading_.restart(keyframes_);
  tracking_.continue_from(pose_);
  scale_.forget_motion();
  new_ground_.forget();
}

void SlamFrontEnd::go_on(const Pose2& T_map_base, SensorTime stamp) {
  new_ground_.forget();
  came_unmeasured_ = false;
  displaced_ = false;
  pose_ = T_map_base;
  covariance_ = diagonal(kFoundSigma, kFoundYawSigma);
  matched_ = stamp;
  doubt_.forget();
  check_.forget();
  companions_.forget();
  scale_.forget_motion();
  weak_motion_ = {};
  unmeasured_.forget();
  tracking_.found_again(stamp);
}

/// The way that it was carried counts as one of the length of the local map, which nobody measured: the old
/// surroundings take the local map's place, and loops may be closed with them.
void SlamFrontEnd::found(const Pose2& T_map_base, const ScanPoints& scan) {
  go_on(T_map_base, scan.stamp);
  driven_ += options_.window;
  joined_until_ = driven_ + options_.joined;
  shown_.setZero();
  const auto nearest =
      std::min_element(keyframes_.begin(), keyframes_.end(), [&](const Keyframe& a, const Keyframe& b) {
        return (a.T_map_base.position() - T_map_base.position()).squaredNorm() <
               (b.T_map_base.position() - T_map_base.position()).squaredNorm();
      });
  const Eigen::Matrix3d drift = nearest->drift + covariance_;
  unseen_ = nearest->unseen;
  broken_at_ = keyframes_.size();
  keep(scan, check_.usually_explained());
  keyframes_.back().drift = drift;
  heading_.restart(keyframes_);
}

SlamState SlamFrontEnd::state(SensorTime stamp) const {
  if (displaced_) return SlamState::lost;
  const double sigma = std::sqrt(std::max(covariance_(0, 0), covariance_(1, 1)));
  if (sigma > kLostSigma) return SlamState::lost;
  const OdometryFault fault = tracking_.fault();
  const bool carried = doubt_.carried() && (fault == OdometryFault::none || fault == OdometryFault::carried);
  const bool doubtful = carried || check_.is_suspected() || fault == OdometryFault::laser_frozen ||
                        unmeasured_.is_unmeasured() || came_unmeasured_ ||
                        (options_.doubt_mounting && tracking_.is_mounting_doubtful());
  return doubtful || sigma > kUnsureSigma || stamp - matched_ > kPatience ? SlamState::unsure
                                                                          : SlamState::tracking;
}

void SlamFrontEnd::keep(const ScanPoints& scan, double explained) {
  Keyframe keyframe;
  keyframe.scan = scan;
  keyframe.T_map_base = pose_;
  keyframe.drift = drift_by_matches(pose_);
  keyframe.unseen = unseen_;
  keyframe.driven = driven_;
  keyframe.scan_index = scans_;
  keyframe.explained = explained;
  keyframe.walls = wall_pieces(scan.points);
  if (!keyframes_.empty()) {
    keyframe.step = keyframes_.back().T_map_base.inverse() * pose_;
    const Eigen::Rotation2Dd R_from_map(-keyframes_.back().T_map_base.yaw);
    keyframe.weak_motion = {R_from_map * weak_motion_.tracked, R_from_map * weak_motion_.reported};
    keyframe.step_information = step_information();
  }
  weak_motion_ = {};
  drift_per_metre_ = drift_per_metre();
  driven_at_keyframe_ = driven_;
  turned_at_keyframe_ = turned_;
  keyframes_.push_back(std::move(keyframe));
  in_map_.push_back(0);
  update_local_map();
}

/// Without what scans show, a straight drive could be bent at no cost to make the ends of a loop meet.
Eigen::Matrix3d SlamFrontEnd::step_information() const {
  const Eigen::Matrix3d by_odometry = odometry_covariance(robot_, driven_ - driven_at_keyframe_,
                                                          turned_ - turned_at_keyframe_, kMinOdometryError);
  Eigen::Matrix3d R_map_from = Eigen::Matrix3d::Identity();
  R_map_from.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(keyframes_.back().T_map_base.yaw).toRotationMatrix();
  return (0.25 * by_odometry).inverse() + kStepByMatch * (R_map_from.transpose() * shown_ * R_map_from);
}

/// The error of a match goes into the map with its scan, and from there into the matches that follow. Noisy
/// lasers drift more, and along a corridor more than across it.
Eigen::Matrix3d SlamFrontEnd::drift_per_metre() const {
  const Eigen::DiagonalMatrix<double, 3> part(kDriftOfMatch, kDriftOfMatch, kYawDriftOfMatch);
  const Eigen::Vector3d min_sigma(kDrift, kDrift, kYawDrift);
  Eigen::Matrix3d drift = part * covariance_ * part;
  drift.diagonal() += min_sigma.cwiseAbs2();
  return drift;
}

/// The drift of the last keyframe, carried on to `pose`.
Eigen::Matrix3d SlamFrontEnd::drift_by_matches(const Pose2& pose) const {
  if (keyframes_.empty()) return Eigen::Matrix3d::Zero();
  const Keyframe& last = keyframes_.back();
  const double driven = drift_squares_ / drift_directions_ * (driven_ - last.driven);
  return propagated_covariance(last.drift, last.T_map_base, pose, driven * drift_per_metre_);
}

/// Odometry's scale is one error for the whole way: on the way back it cancels what it did on the way there.
Eigen::Matrix3d SlamFrontEnd::drift_by_odometry(const Eigen::Vector2d& unseen) const {
  Eigen::Matrix3d drift = Eigen::Matrix3d::Zero();
  drift.topLeftCorner<2, 2>() = unseen * unseen.transpose();
  drift(0, 0) += squared(kUnseenDirection) * unseen.squaredNorm();
  drift(1, 1) += squared(kUnseenDirection) * unseen.squaredNorm();
  return drift;
}

Eigen::Matrix3d SlamFrontEnd::drift_at(const Pose2& pose) const {
  return drift_by_matches(pose) + drift_by_odometry(unseen_);
}

/// What a loop corrected (x, y, yaw of the robot, map frame) against what was expected of it.
void SlamFrontEnd::learn_drift(const Eigen::Vector3d& correction, const Eigen::Matrix3d& expected) {
  constexpr double memory = 0.9;  // weight of the loops before
  drift_squares_ = memory * drift_squares_ + correction.dot(expected.inverse() * correction);
  drift_directions_ = memory * drift_directions_ + 3;
}

void SlamFrontEnd::put(std::size_t keyframe, double weight) {
  const Keyframe& k = keyframes_[keyframe];
  fine_.add(k.scan.points, k.T_map_base, weight);
  coarse_.add(k.scan.points, k.T_map_base, weight);
  in_map_[keyframe] = weight > 0 ? 1 : 0;
}

/// Takes the drift of the heading, as walls show it, out of the end of the path. The scale of odometry goes
/// on over that: forgetting a motion every 4 m would cost it more than bends of a fraction of a degree do.
void SlamFrontEnd::straighten() {
  if (const auto correction = heading_.check(keyframes_)) {
    std::vector<std::size_t> moved;
    for (std::size_t k = correction->first; k < keyframes_.size(); ++k)
      if (in_map_[k] != 0) moved.push_back(k);
    for (const std::size_t k : moved) put(k, -1);
    bend(keyframes_, *correction);
    for (const std::size_t k : moved) put(k, 1);
    pose_ = keyframes_.back().T_map_base;
    tracking_.continue_from(pose_);
    bent_from_ = correction->first;
  }
  heading_.learn(keyframes_);
}

/// The recent path; and, while they fit, old keyframes around the robot. Those that are nearest to the robot
/// come first, as they have seen most of what it sees.
void SlamFrontEnd::update_local_map() {
  const bool joined = driven_ < joined_until_;
  std::vector<std::pair<double, std::size_t>> missing;
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    const bool recent = driven_ - keyframes_[i].driven <= options_.window;
    const double away = (keyframes_[i].T_map_base.position() - pose_.position()).norm();
    bool wanted = recent;
    if (!recent && (in_map_[i] != 0 || joined))
      wanted = joined ? away < options_.surroundings + (in_map_[i] != 0 ? 2 : 0) : false;
    if (wanted && in_map_[i] == 0) missing.emplace_back(away, i);
    if (!wanted && in_map_[i] != 0) put(i, -1);
  }
  std::sort(missing.begin(), missing.end());
  std::size_t points = 0, added = 0;
  for (; added < missing.size() && points < kPointsAdded; ++added) {
    put(missing[added].second, 1);
    points += keyframes_[missing[added].second].scan.points.size();
  }
  is_map_complete_ = added == missing.size();
}

void SlamFrontEnd::correct(const LoopCorrection& correction) {
  new_ground_.forget();
  // A loop that was seen before the path broke says nothing of the way to here.
  const bool covers_path = correction.known_until > broken_at_;
  if (covers_path) came_unmeasured_ = false;
  const Pose2 T_keyframe_base = keyframes_.back().T_map_base.inverse() * pose_;
  const Pose2 before = pose_;
  for (std::size_t i = 0; i < keyframes_.size(); ++i) keyframes_[i].T_map_base = correction.poses[i];
  pose_ = keyframes_.back().T_map_base * T_keyframe_base;
  const Eigen::Vector3d loop(kLoopSigma, kLoopSigma, kLoopYawSigma);
  const Eigen::Matrix3d loop_covariance = loop.cwiseAbs2().asDiagonal();
  Eigen::Matrix3d& drift = keyframes_.back().drift;
  if (covers_path)
    learn_drift({pose_.x - before.x, pose_.y - before.y, wrap_angle(pose_.yaw - before.yaw)},
                drift + drift_by_odometry(unseen_) + loop_covariance);
  const Keyframe& revisited = keyframes_[correction.revisited];
  const Eigen::Matrix3d found = revisited.drift + loop_covariance;
  if (covers_path &&
      (found + drift_by_odometry(revisited.unseen)).trace() < (drift + drift_by_odometry(unseen_)).trace()) {
    drift = found;
    unseen_ = keyframes_.back().unseen = revisited.unseen;
  }
  fine_ = SurfelMap(options_.cell);
  coarse_ = SurfelMap(4 * options_.cell);
  in_map_.assign(keyframes_.size(), 0);
  joined_until_ = driven_ + options_.joined;
  update_local_map();
  heading_.restart(keyframes_);
  tracking_.continue_from(pose_);
  unmeasured_.forget();
  scale_.forget_motion();
}

}  // namespace parhelion::pose
