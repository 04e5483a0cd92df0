#include "fusion/pose/scan_refinement.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "fusion/pose/scan_match.hpp"
#include "fusion/pose/scan_points.hpp"

namespace parhelion::pose {
namespace {

constexpr std::size_t kFewPoints = 120;  ///< for the search from several starts
constexpr std::size_t kMinPoints = 10;
constexpr double kMinExplained = 0.35;  ///< people may surround the robot
/// Distance from the prediction, chi^2 of three degrees of freedom: 99.9 %, and twice as far where nearly all
/// returns lie on the map, since odometry's errors have long tails.
constexpr double kMaxChi2 = 16.3, kMaxSureChi2 = 4 * kMaxChi2;
constexpr double kSure = 0.8;  ///< fraction of explained returns
/// 1 sigma, m and rad: what the map's own accuracy leaves of any match.
constexpr double kMapSigma = 0.005, kMapYawSigma = 0.0017;

/// An error of odometry's twist that was there since the last pose is innovation / time; one that has grown
/// from zero since, with constant acceleration, is twice that. Chosen between them on the generated offices
/// and ring: 1 and 2 leave half as much again of the error in turns.
constexpr double kTwistGain = 1.5;
constexpr double kShortest = 0.02,
                 kLongest = 0.5;  ///< s, of a prediction that says something about the twist
constexpr int kRounds = 2, kMoreIterations = 4;
/// m, at the end of the sweep and `kLever` m away: a smaller correction of the twist is not worth the time.
constexpr double kMinBend = 0.002, kLever = 5;

/// `count` of the items at most, spread evenly.
template <class T, class Use>
void spread(const std::vector<T>& items, std::size_t count, Use use) {
  const std::size_t n = std::min(items.size(), count);
  for (std::size_t i = 0; i < n; ++i) use(items[i * items.size() / n]);
}

/// s, between the stamp and the beam farthest from it.
double longest_beam_time(const LaserDescription& laser, std::size_t beams) {
  return beams == 0 ? 0
                    : std::max(std::abs(laser.beam_time(0, beams).seconds()),
                               std::abs(laser.beam_time(beams - 1, beams).seconds()));
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
    : laser_(laser), map_(std::move(map)) {
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

void ScanRefiner::refine_twist(const Scan& scan, const MatchPrior& prior, const Eigen::Matrix3d& information,
                               const MatchOptions& options, Match& found, Twist2& twist) {
  if (prior.predicted_for < kShortest || prior.predicted_for > kLongest) return;
  const double sweep = longest_beam_time(laser_, scan.ranges.size());
  MatchOptions quick = options;
  quick.iterations = kMoreIterations;
  for (int round = 0; round < kRounds; ++round) {
    const Twist2 missing =
        twist_between(prior.T_map_base, found.T_map_base, prior.predicted_for / kTwistGain);
    const Twist2 corrected{prior.twist.vx + missing.vx, prior.twist.vy + missing.vy,
                           prior.twist.wz + missing.wz};
    if (!(sweep * speed_between(twist, corrected) > kMinBend)) return;
    twist = corrected;
    place_points(scan, twist, prior.attitude);
    found = match(map_->fine, points_, found.T_map_base, prior.T_map_base, information, quick);
  }
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
  refined.T_map_base = found.T_map_base;
  refined.residual = found.rms;
  refined.explained = found.explained;
  const Eigen::Vector3d moved = offset(prior.T_map_base, found.T_map_base);
  refined.covariance = (information + found.information).inverse();
  refined.covariance.diagonal() +=
      Eigen::Vector3d(kMapSigma * kMapSigma, kMapSigma * kMapSigma, kMapYawSigma * kMapYawSigma);
  if (!found.T_map_base.finite() || !refined.covariance.allFinite() || found.explained < kMinExplained) {
    refined.match = ScanMatch::unexplained;
  } else if (!(moved.dot(information * moved) <= (found.explained >= kSure ? kMaxSureChi2 : kMaxChi2))) {
    refined.match = ScanMatch::beyond_prior;
  } else {
    refined.match = ScanMatch::matched;
  }
  return refined;
}

}  // namespace parhelion::pose
