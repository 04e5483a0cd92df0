#include "fusion/pose/tracking/scan_tracking.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace parhelion::pose {
namespace {

constexpr double kSure = 0.85;  ///< fraction of explained points of a match that needs no second one
/// A match without odometry is preferred to one with it if it is good, and costs less by this much and this
/// fraction: where the map is thin, many a wrong place costs a little less.
constexpr double kGood = 0.6, kContradiction = 15, kMuchBetter = 0.65;
constexpr double kAnnounced = 0.1, kAnnouncedYaw = 0.2;  ///< m, rad, of a robot at rest
/// m/s, and of the robot's speed so far: what it may have moved if odometry stood still.
constexpr double kLeapSpeed = 2, kLeapFactor = 1.5;
constexpr double kUsualErrors = 2;  ///< sigma, of what was predicted so far
constexpr double kIrregular = 0.3;  ///< mean deviation of an interval from the usual one, as a fraction
constexpr double kLongestGap = 10;  ///< intervals over which the motion is extrapolated
constexpr double kSame = 0.04, kSameYaw = 0.03;              ///< m, rad: one start for both matches
constexpr double kKnownSigma = 0.03, kKnownYawSigma = 0.01;  ///< m, rad: the points alone give the pose
constexpr double kKnownFraction = 0.55;                      ///< explained points
constexpr double kSmooth = 0.08, kSmoothFraction = 0.5;  ///< m, and of a step: errors of predicted positions
constexpr double kMatchedFraction = 0.3;      ///< of explained points, below which a match is no evidence
constexpr Duration kPatience = seconds(3.0);  ///< without one
/// m, rad: what the motion between two scans cannot predict of the next, at least.
constexpr double kPredictedSigma = 0.03, kPredictedYawSigma = 0.05;
/// m, rad: how far apart odometry and the motion so far may predict the robot, to be believed over a scan
/// that the map explains better elsewhere (chosen on fr-clinic, SENA and UAL), and over one that it does not
/// explain (chosen on SENA and the generated ramp).
constexpr double kAgree = 0.1, kAgreeYaw = 0.05, kAgreeUnexplained = 0.2, kAgreeUnexplainedYaw = 0.1;
/// rad, and cost by which the scan may contradict that the robot drove on while odometry froze.
constexpr double kDrivenOnYawSigma = 0.1, kStandingCost = 3;
/// m, 1 sigma by the points alone: along a direction with more, as along a bare corridor, they do not show
/// where the robot is. In generated bare corridors it is 0.1 m or more, in offices 0.02 m or less.
constexpr double kShownSigma = 0.05;
constexpr double kUnknownSigma = 0.4, kUnknownYawSigma = 0.4;  ///< m, rad: nothing predicts the pose
/// m, and m/s since the last match: how far from what odometry or the motion so far predicts a wide search
/// may find the robot. Farther away another place looks alike, as niches of a wall do.
/// Chosen on the generated ramp.
constexpr double kStray = 0.3, kStrayRate = 1;
/// A wide search takes some 10 ms: each scan for so long after the last match, then one in so long.
constexpr Duration kSearchedAtOnce = seconds(1.0), kSearchedEvery = milliseconds(500);

constexpr double squared(double x) { return x * x; }

bool is_contradiction(const Match& with_odometry, const Match& without) {
  if (with_odometry.explained < kMatchedFraction && without.explained > kMatchedFraction &&
      without.explained > 2 * with_odometry.explained) {
    return true;
  }
  return without.explained >= kGood && without.cost + kContradiction < with_odometry.cost &&
         without.cost < kMuchBetter * with_odometry.cost;
}

/// The points of a match determine where it lies along the line to another place.
bool is_shown_beside(const Match& found, const Pose2& other) {
  const Eigen::Vector2d apart = found.T_map_base.position() - other.position();
  if (apart.norm() < kSame) return true;
  const Eigen::Vector2d along = apart.normalized();
  const Eigen::Matrix3d covariance = (found.information + 1e-3 * Eigen::Matrix3d::Identity()).inverse();
  return along.dot(covariance.topLeftCorner<2, 2>() * along) < squared(kShownSigma);
}

bool is_near(const Pose2& a, const Pose2& b, double position, double yaw) {
  const Pose2 apart = a.inverse() * b;
  return apart.position().norm() < position && std::abs(apart.yaw) < yaw;
}

/// x, y, yaw, where nothing predicts the pose.
Eigen::Matrix3d unknown_covariance() {
  return Eigen::Vector3d(squared(kUnknownSigma), squared(kUnknownSigma), squared(kUnknownYawSigma))
      .asDiagonal();
}

Match lower_cost(const Match& a, const Match& b) { return b.cost < a.cost ? b : a; }

}  // namespace

Eigen::Matrix3d odometry_covariance(const RobotDescription& robot, double driven, double turned,
                                    double min_sigma) {
  // Wider than the description, with lower bounds: if the filter trusted a systematic error (a bent axis, a
  // wrong wheel), each match would lag by a little, and the map built from them would bend.
  const double position = 4 * robot.odometry_error_translation * driven + min_sigma;
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

Twist2 ScanTracking::twist_at(const Twist2& odometry) const {
  if (fault() == OdometryFault::none) return odometry;
  if (!motion_.known) return {};
  const Twist2 step = twist_to(motion_.step);
  return {step.vx / motion_.interval, step.vy / motion_.interval, step.wz / motion_.interval};
}

ScanTracking::Where ScanTracking::by_odometry(const Where& before, const ScanOdometry::Step& step) const {
  const Pose2 expected = before.T_map_base * step.step;
  const Eigen::Matrix3d error = odometry_covariance(robot_, step.step.position().norm(),
                                                    std::abs(step.step.yaw), options_.min_odometry_error);
  return {expected, propagated_covariance(before.covariance, before.T_map_base, expected, error)};
}

/// How many times the usual interval has passed since the previous scan; 1 where stamps are irregular.
double ScanTracking::intervals_until(SensorTime stamp) const {
  if (!previous_ || motion_.irregularity > kIrregular) return 1;
  return std::clamp((stamp - previous_->stamp).seconds() / motion_.interval, 0.1, kLongestGap);
}

/// Where the motion so far puts the robot at the scan's stamp. It is the motion between the middles of
/// sweeps: taken between stamps, an error of the motion that was assumed during one sweep would return in the
/// next with the opposite sign, and grow where sweeps fill the time between scans.
Pose2 ScanTracking::moved_on(const ScanPoints& scan, double intervals) const {
  const Pose2 to_middle = previous_ ? previous_->to_middle : Pose2{};
  return by_scans_alone_ * to_middle * moved(twist_to(motion_.step), intervals) * scan.to_middle.inverse();
}

ScanTracking::Where ScanTracking::by_scans(const ScanPoints& scan, const Where& before) const {
  if (!motion_.known) {
    return {before.T_map_base, before.covariance + unknown_covariance()};
  }
  const double intervals = intervals_until(scan.stamp), longer = std::max(1.0, intervals);
  const Pose2 expected = moved_on(scan, intervals);
  const double position = squared(longer * kPredictedSigma) + 4 * longer * motion_.position_variance;
  const double yaw = squared(longer * kPredictedYawSigma) + 4 * longer * motion_.yaw_variance;
  const Eigen::Matrix3d error = Eigen::Vector3d(position, position, yaw).asDiagonal();
  return {expected, propagated_covariance(before.covariance, before.T_map_base, expected, error)};
}

void ScanTracking::learn(const Pose2& step) {
  constexpr double memory = 0.06;  // weight of one scan
  if (motion_.known) {
    const Pose2 off = motion_.step.inverse() * step;
    motion_.position_variance += memory * (off.position().squaredNorm() / 2 - motion_.position_variance);
    motion_.yaw_variance += memory * (squared(off.yaw) - motion_.yaw_variance);
  }
  motion_.step = step;
  motion_.known = true;
}

bool ScanTracking::may_search_widely(SensorTime stamp) const {
  return previous_ && (stamp - matched_ < kSearchedAtOnce || stamp - searched_ > kSearchedEvery);
}

bool ScanTracking::is_stray(SensorTime stamp, const Pose2& found, const Pose2& odometry,
                            const Pose2& scans) const {
  const double off =
      std::min((found.position() - odometry.position()).norm(), (found.position() - scans.position()).norm());
  return off > kStray + kStrayRate * (stamp - matched_).seconds();
}

/// Where stamps do not say how long ago the previous scan was, a scan that `found` explains badly may have
/// been taken two intervals after it, or at the same place: that match, where it is far better.
Match ScanTracking::after_other_intervals(const Maps& maps, const ScanPoints& scan,
                                          const Eigen::Matrix3d& prior, const Match& found,
                                          const MatchOptions& options) const {
  Match best = found;
  if (!motion_.known || found.explained >= kSure) return best;
  for (const double intervals : {0.0, 2.0}) {
    const Pose2 expected = moved_on(scan, intervals);
    const Match other = match_from_several(maps.fine, maps.coarse, scan.points, expected, prior, options);
    if (other.explained >= kGood && other.cost + kContradiction < best.cost) best = other;
  }
  return best;
}

/// With odometry and without; the second wins where it contradicts the first, unless the motion so far
/// `agrees` with odometry.
ScanTracking::Candidates ScanTracking::candidates(const Maps& maps, const ScanPoints& scan,
                                                  const Where& odometry, const Where& scans, bool trusted,
                                                  bool agrees, const MatchOptions& options) const {
  const Eigen::Matrix3d scans_prior = scans.covariance.inverse();
  const auto several = [&](const Where& expected, const Eigen::Matrix3d& prior) {
    return match_from_several(maps.fine, maps.coarse, scan.points, expected.T_map_base, prior, options);
  };
  if (!trusted) {
    // What odometry reports may still be better than nothing, where it is not held to it.
    const Match wide =
        match(maps.fine, scan.points, odometry.T_map_base, odometry.T_map_base, scans_prior, options);
    const Match free = lower_cost(several(scans, scans_prior), wide);
    const Match other = after_other_intervals(maps, scan, scans_prior, free, options);
    return {{other, scans, false}, other};
  }
  const Match with = several(odometry, odometry.covariance.inverse());
  Match free = match(maps.fine, scan.points, with.T_map_base, scans.T_map_base, scans_prior, options);
  const bool same = is_near(with.T_map_base, scans.T_map_base, kSame, kSameYaw);
  // Where odometry and the scans so far agree, a second search could not contradict the first.
  const bool settled = agrees && is_near(with.T_map_base, scans.T_map_base, kAgree, kAgreeYaw);
  if (!settled && (with.explained < kSure || !same)) free = lower_cost(free, several(scans, scans_prior));
  // Of odometry that is suspected already, the motion so far need not have announced the scan's place.
  const bool possible = sanity_.is_suspected() || is_announced(free.T_map_base, scans.T_map_base, scan.stamp);
  const bool contradicted =
      !agrees && possible && is_contradiction(with, free) && is_shown_beside(free, with.T_map_base);
  return {contradicted && !is_leap(scan.stamp, free.T_map_base, odometry.T_map_base)
              ? Followed{free, scans, false}
              : Followed{with, odometry, true},
          free};
}

ScanTracking::Followed ScanTracking::follow(const Maps& maps, const ScanPoints& scan, const Where& before,
                                            const ScanOdometry::Step& step, const MatchOptions& options) {
  const Where odometry = by_odometry(before, step), scans = by_scans(scan, before);
  bool trusted = is_trusted(step, scan.stamp);
  // Odometry that agrees with the scans so far is believed: before its foot a ramp hides the map, and looks
  // like a wall that comes along.
  const bool agrees =
      trusted && motion_.known && is_near(odometry.T_map_base, scans.T_map_base, kAgree, kAgreeYaw);
  auto [result, free] = candidates(maps, scan, odometry, scans, trusted, agrees, options);
  if (const auto off = trusted ? moved_off(maps, scan, before, result.match, options) : std::nullopt) {
    result = *off;
    free = off->match;
    trusted = false;
  }
  const bool first_to_show = free.explained >= kKnownFraction && frozen_.add_match(free.T_map_base.yaw);
  const auto on = first_to_show ? driven_on(maps, scan, before, result.match, options) : std::nullopt;
  if (on) {
    result = *on;
    free = on->match;
  }
  const bool predicted =
      trusted && !sanity_.is_suspected() &&
      is_near(odometry.T_map_base, scans.T_map_base, kAgreeUnexplained, kAgreeUnexplainedYaw);
  if (result.match.explained < kMatchedFraction && !predicted) {
    std::optional<Match> found;
    if (maps.wide_search && may_search_widely(scan.stamp)) {
      searched_ = scan.stamp;
      found = maps.wide_search(scan, scans.T_map_base);
      if (found && is_stray(scan.stamp, found->T_map_base, odometry.T_map_base, scans.T_map_base))
        found.reset();
    }
    if (found) {
      result = {*found, {found->T_map_base, unknown_covariance()}, false};
      free = *found;
    } else if (scans.covariance.trace() > result.expected.covariance.trace()) {
      // Where the map explains nothing, odometry may be what is wrong.
      result.expected.covariance = scans.covariance;
    }
  }
  if (options_.growing && result.by_odometry && result.match.explained >= kMatchedFraction) {
    const bool same = is_near(free.T_map_base, result.match.T_map_base, kSame, kSameYaw);
    result.match = refined(maps, scan, result, options);
    // What draws the one match draws the other, and odometry must not be accused of it.
    if (same) free = refined(maps, scan, {free, scans, false}, options);
  }
  if (free.explained >= kMatchedFraction || !previous_) matched_ = scan.stamp;
  if (scan.stamp - matched_ > kPatience) sanity_.give_up(scan.stamp);
  if (frozen_.is_certain()) sanity_.froze(scan.stamp);
  check_odometry(scan, step, free);
  if (on)
    go_on_from(on->match.T_map_base, frozen_.step());
  else
    follow_alone(scan, before.T_map_base, scans.T_map_base, result.match, free);
  compare_twists(scan.stamp, before.T_map_base, result.match.T_map_base, step.twist);
  learn_interval(scan.stamp);
  weigh(maps, scan, options, result.match);
  previous_ = scan;
  return result;
}

/// Without what draws a match in a growing map. How the robot moves by scans alone needs those points: where
/// odometry says nothing, the edge of the map shows more than it errs.
Match ScanTracking::refined(const Maps& maps, const ScanPoints& scan, const Followed& found,
                            const MatchOptions& options) const {
  MatchOptions growing = options;
  growing.growing = true;
  return match(maps.fine, scan.points, found.match.T_map_base, found.expected.T_map_base,
               found.expected.covariance.inverse(), growing);
}

/// Odometry has no known fault, has not just frozen, and was not stuck from the start.
bool ScanTracking::is_trusted(const ScanOdometry::Step& step, SensorTime stamp) {
  if (stuck_.is_stuck()) {
    frozen_.forget();
    return false;
  }
  if (!step.known || fault() != OdometryFault::none || !motion_.known) {
    frozen_.forget();
    return step.known && fault() == OdometryFault::none;
  }
  frozen_.add(step.step, {by_scans_alone_, motion_.step, motion_.interval}, intervals_until(stamp));
  return !frozen_.is_frozen();
}

/// Where the robot is if it has moved off while odometry has stood still from the start.
std::optional<ScanTracking::Followed> ScanTracking::moved_off(const Maps& maps, const ScanPoints& scan,
                                                              const Where& before, const Match& standing,
                                                              const MatchOptions& options) {
  if (!previous_) return std::nullopt;
  const Where expected{before.T_map_base, before.covariance + unknown_covariance()};
  const auto found = stuck_.moved_off(maps.fine, scan.points, before.T_map_base, standing,
                                      expected.covariance.inverse(), options);
  if (!found || is_leap(scan.stamp, found->T_map_base, before.T_map_base)) return std::nullopt;
  return Followed{*found, expected, false};
}

/// Where the robot is if odometry froze and it drove on, unless the scan contradicts that more than it does
/// that the robot stands.
std::optional<ScanTracking::Followed> ScanTracking::driven_on(const Maps& maps, const ScanPoints& scan,
                                                              const Where& before, const Match& standing,
                                                              const MatchOptions& options) const {
  const double sigma = frozen_.sigma();
  const Eigen::Matrix3d error =
      Eigen::Vector3d(squared(sigma), squared(sigma), squared(kDrivenOnYawSigma)).asDiagonal();
  const Where expected{frozen_.driven_on(), before.covariance + error};
  const Match found = match_from_several(maps.fine, maps.coarse, scan.points, expected.T_map_base,
                                         expected.covariance.inverse(), options);
  if (found.explained < kKnownFraction || found.cost > standing.cost + kStandingCost) return std::nullopt;
  return Followed{found, expected, false};
}

/// How much a match is worth is learned from scans that the map explains.
void ScanTracking::weigh(const Maps& maps, const ScanPoints& scan, const MatchOptions& options,
                         const Match& found) {
  if (found.explained < kMatchedFraction) return;
  const std::vector<Eigen::Vector2d> points = thinned(scan.points, kWeighedPoints);
  consistency_.add(maps.fine, points, found.T_map_base, options);
  map_accuracy_.add(maps.fine, points, found.T_map_base);
}

void ScanTracking::compare_twists(SensorTime stamp, const Pose2& before, const Pose2& after,
                                  const Twist2& odometry) {
  const double seconds = previous_ ? (stamp - previous_->stamp).seconds() : 0;
  if (seconds <= 0) return;
  twist_off_ = std::abs(wrap_angle(after.yaw - before.yaw) / seconds - twist_at(odometry).wz);
}

Eigen::Matrix3d ScanTracking::published(const Eigen::Matrix3d& covariance) const {
  // The twist of the scans is that of the time since the previous one: a part of the difference is its change
  // since then. Chosen on generated offices.
  constexpr double share = 0.6;
  const auto beams = static_cast<std::size_t>(std::max(robot_.laser->beams, 1));
  const Duration first = robot_.laser->beam_time(0, beams), last = robot_.laser->beam_time(beams - 1, beams);
  const double mean_beam = std::abs((first + last).seconds()) / 2;  // s, from the stamp
  const double position = map_accuracy_.position_sigma();
  const double yaw = std::hypot(map_accuracy_.yaw_sigma(), share * mean_beam * twist_off_);
  const Eigen::Matrix3d systematic =
      Eigen::Vector3d(squared(position), squared(position), squared(yaw)).asDiagonal();
  const Eigen::Matrix3d regular = 1e-9 * Eigen::Matrix3d::Identity();  // m^2, rad^2: at the start it is zero
  return consistency_.information((covariance + regular).inverse()).inverse() + systematic;
}

void ScanTracking::learn_interval(SensorTime stamp) {
  if (!previous_) return;
  const double seconds = (stamp - previous_->stamp).seconds();
  motion_.interval += 0.1 * (std::clamp(seconds, 0.01, 1.0) - motion_.interval);
  const double off = std::abs(seconds / motion_.interval - 1);
  motion_.irregularity += 0.05 * (std::min(off, 1.0) - motion_.irregularity);
}

/// A ramp in front of the robot looks like a wall that comes along: what neither odometry nor the motion so
/// far has announced is no evidence. Over a gap of several intervals the motion may change as often.
bool ScanTracking::is_announced(const Pose2& found, const Pose2& predicted, SensorTime stamp) const {
  if (!motion_.known) return true;
  const Pose2 off = predicted.inverse() * found;
  const double longer = std::max(1.0, intervals_until(stamp));
  return off.position().norm() < kAnnounced + longer * motion_.step.position().norm() / 2 +
                                     kUsualErrors * std::sqrt(motion_.position_variance) &&
         std::abs(off.yaw) < kAnnouncedYaw + longer * std::abs(motion_.step.yaw) / 2 +
                                 kUsualErrors * std::sqrt(motion_.yaw_variance);
}

/// Farther from where odometry predicts it than a robot gets since the previous scan, whatever odometry says:
/// along a corridor the scans' own track may have been drawn away by people, by what is new, or to the next
/// door.
bool ScanTracking::is_leap(SensorTime stamp, const Pose2& found, const Pose2& odometry) const {
  const double seconds = previous_ ? (stamp - previous_->stamp).seconds() : 0;
  const double possible = std::max(kLeapSpeed, kLeapFactor * speed()) * std::max(seconds, motion_.interval);
  return (found.position() - odometry.position()).norm() > options_.max_leap + possible;
}

/// The pose by scans alone continues for itself: a wrong choice must not destroy what contradicts it. Where
/// the map explains nothing it goes on with the motion so far, for a while.
void ScanTracking::follow_alone(const ScanPoints& scan, const Pose2& before, const Pose2& predicted,
                                const Match& chosen, const Match& free) {
  const bool matched = chosen.explained >= kMatchedFraction;
  if (!matched && scan.stamp - matched_ < kSearchedAtOnce) {
    by_scans_alone_ = predicted;
    alone_is_predicted_ = true;
    return;
  }
  const bool same = is_near(chosen.T_map_base, free.T_map_base, kSame, kSameYaw);
  const bool worse = free.explained < kMatchedFraction || free.explained + 0.1 < chosen.explained ||
                     !is_announced(free.T_map_base, predicted, scan.stamp);
  const bool shown = is_shown_beside(free, chosen.T_map_base);
  const Pose2 from = previous_ && !worse && shown ? by_scans_alone_ : before;
  const Pose2 to = same || worse || !shown ? chosen.T_map_base : free.T_map_base;
  const Pose2 before_to_middle = previous_ ? previous_->to_middle : scan.to_middle;
  const Pose2 step = (from * before_to_middle).inverse() * to * scan.to_middle;
  if (!alone_is_predicted_) learn(moved(twist_to(step), 1 / intervals_until(scan.stamp)));
  by_scans_alone_ = to;
  alone_is_predicted_ = false;
}

/// The place of a robot whose motion is known.
void ScanTracking::go_on_from(const Pose2& T_map_base, const Pose2& step) {
  by_scans_alone_ = T_map_base;
  motion_.step = step;
  alone_is_predicted_ = false;
}

/// A robot cannot jump: where its position by scans does (along a corridor that people walk down), scans are
/// no evidence of how far it drove.
bool ScanTracking::moves_smoothly() const {
  const double usual = std::max(kSmooth, kSmoothFraction * motion_.step.position().norm());
  return !motion_.known || motion_.position_variance < squared(usual);
}

void ScanTracking::check_odometry(const ScanPoints& scan, const ScanOdometry::Step& odometry,
                                  const Match& free) {
  if (!previous_) return;
  ScanStep step;
  step.stamp = scan.stamp;
  step.seconds = (scan.stamp - previous_->stamp).seconds();
  step.odometry = odometry.reported;
  step.odometry_known = odometry.known;
  step.scans = by_scans_alone_.inverse() * free.T_map_base;
  step.repeated = scan.ranges_hash == previous_->ranges_hash;
  if (free.explained >= kKnownFraction) {
    const Eigen::Matrix3d covariance = (free.information + 1e-3 * Eigen::Matrix3d::Identity()).inverse();
    // The largest eigenvalue is at most the trace.
    step.position_known = covariance(0, 0) + covariance(1, 1) < squared(kKnownSigma) && moves_smoothly();
    step.yaw_known = covariance(2, 2) < squared(kKnownYawSigma);
  }
  sanity_.add(step);
}

void ScanTracking::forget() {
  stuck_.forget_place();
  motion_ = {};
  frozen_.forget();
  previous_.reset();
  alone_is_predicted_ = false;
}

}  // namespace parhelion::pose
