#include "fusion/pose/scan_refinement.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "fusion/pose/matching/scan_match.hpp"
#include "fusion/pose/matching/scan_points.hpp"

namespace parhelion::pose {
namespace {

constexpr std::size_t kFewPoints = 120;  ///< for the search from several starts
constexpr std::size_t kMinPoints = 10;
constexpr double kMinExplained = 0.35;  ///< people may surround the robot
/// Distance from the prediction, chi^2 of three degrees of freedom: 99.9 %, and twice as far where nearly all
/// returns lie on the map, since odometry's errors have long tails.
constexpr double kMaxChi2 = 16.3, kMaxSureChi2 = 4 * kMaxChi2;
constexpr double kSure = 0.8;  ///< fraction of explained returns
/// 1 sigma of the twist that is acceleration since the last step, as a fraction of it. Chosen on generated
/// offices, with odometry and scans of several rates.
constexpr double kUncertainGain = 0.3;
constexpr double kRegular = 1e-3;                   ///< 1/m^2: keeps what nothing is known of finite
constexpr double kShortest = 0.02, kLongest = 0.5;  ///< s, of a step that says something about the twist
constexpr int kRounds = 2, kMoreIterations = 4;
/// m, at the end of the sweep and `kLever` m away: a smaller correction of the twist is not worth the time.
constexpr double kMinBend = 0.002, kLever = 5;

/// `count` of the items at most, spread evenly.
template <class T, class Use>
void spread(const std::vector<T>& items, std::size_t count, Use use) {
  const std::size_t n = std::min(items.size(), count);
  for (std::size_t i = 0; i < n; ++i) use(items[i * items.size() / n]);
}

constexpr double squared(double x) { return x * x; }

/// s, between the stamp and the beam farthest from it.
double longest_beam_time(const LaserDescription& laser, const Scan& scan) {
  const std::size_t beams = scan.ranges.size();
  return beams == 0 ? 0
                    : std::max(std::abs(laser.beam_time(0, scan).seconds()),
                               std::abs(laser.beam_time(beams - 1, scan).seconds()));
}

/// s, of the beams' mean after the stamp.
double middle_beam_time(const LaserDescription& laser, const Scan& scan) {
  const std::size_t beams = scan.ranges.size();
  return beams == 0 ? 0
                    : (laser.beam_time(0, scan).seconds() + laser.beam_time(beams - 1, scan).seconds()) / 2;
}

/// m/s, of a point `kLever` m away.
double speed_between(const Twist2& a, const Twist2& b) {
  return std::hypot(b.vx - a.vx, b.vy - a.vy) + kLever * std::abs(b.wz - a.wz);
}

Eigen::Vector3d offset(const Pose2& from, const Pose2& to) {
  return {to.x - from.x, to.y - from.y, wrap_angle(to.yaw - from.yaw)};
}

}  // namespace

const char* to_string(ScanMatch match) {
  switch (match) {
    case ScanMatch::matched:
      return "matched";
    case ScanMatch::off:
      return "off";
    case ScanMatch::no_prior:
      return "no recent pose from SLAM, or no odometry";
    case ScanMatch::few_points:
      return "too few returns";
    case ScanMatch::unexplained:
      return "too few returns on the map's surfaces";
    case ScanMatch::beyond_prior:
      return "farther from the predicted pose than it can be wrong";
  }
  return "unknown";
}

ScanRefiner::ScanRefiner(const LaserDescription& laser, std::shared_ptr<const MatchingMap> map)
    : laser_(laser), map_(std::move(map)), consistency_(kPoints), map_accuracy_(kPoints) {
  points_.reserve(kPoints);
  few_.reserve(kFewPoints);
}

void ScanRefiner::find_hits(const Scan& scan) {
  hits_.clear();
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    if (laser_.convention.classify(scan.ranges[i]) == BeamKind::hit)
      hits_.push_back(static_cast<std::uint32_t>(i));
  }
}

void ScanRefiner::place_points(const Scan& scan, const Twist2& twist,
                               const std::optional<Attitude>& attitude) {
  const Deskewing deskewing(laser_, twist, attitude);
  points_.clear();
  spread(hits_, kPoints, [&](std::uint32_t beam) {
    if (const auto point = deskewing.point(scan, beam)) points_.push_back(*point);
  });
}

std::optional<ScanRefiner::SweepTwist> ScanRefiner::twist_by_scans(const Scan& scan, const MatchPrior& prior,
                                                                   const Pose2& found) const {
  if (!prior.before) return std::nullopt;
  const double step = (scan.stamp - prior.before->stamp).seconds();
  if (step < kShortest || step > kLongest || prior.before->seconds < kShortest) return std::nullopt;
  const Twist2 mean = twist_between(prior.before->T_map_base, found, step);
  const Twist2& earlier = prior.before->twist;
  // The means hold in the middle of their steps.
  const double ahead = step / 2 + middle_beam_time(laser_, scan);
  const double factor = ahead / ((step + prior.before->seconds) / 2);
  const Twist2 gained{factor * (mean.vx - earlier.vx), factor * (mean.vy - earlier.vy),
                      factor * (mean.wz - earlier.wz)};
  return SweepTwist{{mean.vx + gained.vx, mean.vy + gained.vy, mean.wz + gained.wz}, gained};
}

void ScanRefiner::refine_twist(const Scan& scan, const MatchPrior& prior, const Eigen::Matrix3d& information,
                               const MatchOptions& options, Match& found, Twist2& twist) {
  const double sweep = longest_beam_time(laser_, scan);
  MatchOptions quick = options;
  quick.iterations = kMoreIterations;
  for (int round = 0; round < kRounds; ++round) {
    const auto by_scans = twist_by_scans(scan, prior, found.T_map_base);
    if (!by_scans || !(sweep * speed_between(twist, by_scans->twist) > kMinBend)) return;
    twist = by_scans->twist;
    place_points(scan, twist, prior.attitude);
    found = match(map_->fine, points_, found.T_map_base, prior.T_map_base, information, quick);
  }
}

/// The match weighs the points with their formal information H and the prediction with P, so that
/// H (x - m) + P (x - p) = 0 where m is the pose by the points alone and p the prediction. With the true
/// information of the points in place of H, the sum is zero a little nearer to m.
void ScanRefiner::weigh_by_consistency(const MatchPrior& prior, const Eigen::Matrix3d& P,
                                       Match& found) const {
  const Eigen::Matrix3d H = found.information + kRegular * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d H_true = consistency_.information(H);
  const Eigen::Vector3d moved = offset(prior.T_map_base, found.T_map_base);
  const Eigen::Vector3d step =
      (H_true + P).ldlt().solve((H_true * H.inverse() - Eigen::Matrix3d::Identity()) * P * moved);
  found.T_map_base = {found.T_map_base.x + step.x(), found.T_map_base.y + step.y(),
                      wrap_angle(found.T_map_base.yaw + step.z())};
  found.information = H_true;
}

Eigen::Matrix3d ScanRefiner::covariance_of(const Scan& scan, const MatchPrior& prior,
                                           const Eigen::Matrix3d& information, const Match& found) const {
  Eigen::Matrix3d covariance = (found.information + information).inverse();
  // A twist that is wrong moves the points, and the pose with them, by what it does in half a sweep.
  double position = squared(map_accuracy_.position_sigma()), yaw = squared(map_accuracy_.yaw_sigma());
  if (const auto by_scans = twist_by_scans(scan, prior, found.T_map_base)) {
    const double half = middle_beam_time(laser_, scan);
    const Twist2& gained = by_scans->gained;
    position += squared(kUncertainGain * half) * (squared(gained.vx) + squared(gained.vy)) / 2;
    yaw += squared(kUncertainGain * half * gained.wz);
  }
  covariance.diagonal() += Eigen::Vector3d(position, position, yaw);
  return covariance;
}

RefinedPose ScanRefiner::refine(const Scan& scan, const MatchPrior& prior) {
  RefinedPose refined;
  find_hits(scan);
  place_points(scan, prior.twist, prior.attitude);
  few_.clear();
  spread(points_, kFewPoints, [&](const Eigen::Vector2d& point) { few_.push_back(point); });
  if (points_.size() < kMinPoints) {
    refined.match = ScanMatch::few_points;
    return refined;
  }
  const Eigen::Matrix3d information = prior.covariance.inverse();
  MatchOptions options;
  options.range_sigma = map_->sigma;
  Match found =
      match_from_several(map_->fine, map_->coarse, points_, few_, prior.T_map_base, information, options);
  refined.twist = prior.twist;
  refine_twist(scan, prior, information, options, found, refined.twist);
  refined.residual = found.rms;
  refined.explained = found.explained;
  refined.match = ScanMatch::unexplained;
  if (!found.T_map_base.finite() || found.explained < kMinExplained) return refined;
  const Pose2 matched = found.T_map_base;
  weigh_by_consistency(prior, information, found);
  refined.T_map_base = found.T_map_base;
  refined.covariance = covariance_of(scan, prior, information, found);
  if (!refined.T_map_base.finite() || !refined.covariance.allFinite()) return refined;
  const Eigen::Vector3d moved = offset(prior.T_map_base, refined.T_map_base);
  const double max_chi2 = found.explained >= kSure ? kMaxSureChi2 : kMaxChi2;
  refined.match = moved.dot(information * moved) <= max_chi2 ? ScanMatch::matched : ScanMatch::beyond_prior;
  if (refined.match != ScanMatch::matched) return refined;
  consistency_.add(map_->fine, points_, matched, options);
  map_accuracy_.add(map_->fine, points_, matched);
  return refined;
}

}  // namespace parhelion::pose
