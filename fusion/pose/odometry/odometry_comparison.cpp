#include "fusion/pose/odometry/odometry_comparison.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>

namespace parhelion::pose {
namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr double kNoise = 0.012;                              ///< m and rad, of one pair
constexpr double kEnoughPath = 0.35, kEnoughTurn = 0.4;       ///< m, rad, in a window
constexpr double kPathForFactor = 0.9, kTurnForFactor = 1.2;  ///< m, rad
/// Of a factor. The UAL car of the recordings turns 27 % more by its odometry in its sharpest curve, and
/// scans follow it all the same.
constexpr double kToleratedScale = 0.3;
constexpr double kTolerated = 0.25;  ///< of the motion; smaller systematic errors are for `calibrate`

constexpr double squared(double x) { return x * x; }

/// One row of the gain: least squares of `odometry` on (along, turn), near the identity where the motion does
/// not show it.
class Row {
 public:
  Row(double along, double along_sigma, double turn, double turn_sigma) {
    H_ = Eigen::Vector2d(squared(kNoise / along_sigma), squared(kNoise / turn_sigma)).asDiagonal();
    b_ = H_ * Eigen::Vector2d(along, turn);
  }
  void add(double odometry, double along, double turn) {
    const Eigen::Vector2d x(along, turn);
    H_ += x * x.transpose();
    b_ += odometry * x;
  }
  Eigen::RowVector2d solution() const { return H_.ldlt().solve(b_).transpose(); }
  /// `mean_square`: of the residuals.
  Eigen::RowVector2d sigma(double mean_square) const {
    const Eigen::Matrix2d covariance = std::max(squared(kNoise), mean_square) * H_.inverse();
    return covariance.diagonal().cwiseSqrt().transpose();
  }

 private:
  Eigen::Matrix2d H_;
  Eigen::Vector2d b_;
};

/// Sums of absolute values must not grow where the robot stands.
double beyond_noise(double motion) { return std::abs(motion) > 2 * kNoise ? std::abs(motion) : 0; }

void add_sums(const MotionPair& pair, MotionComparison& sums) {
  sums.seconds += pair.seconds;
  if (pair.position_known) {
    sums.path_odometry += beyond_noise(pair.odometry.head<2>().norm());
    sums.path_scans += beyond_noise(pair.scans.head<2>().norm());
    sums.across += std::abs(pair.scans.y());
    sums.total_odometry.head<2>() += pair.odometry.head<2>();
    sums.total_scans.head<2>() += pair.scans.head<2>();
  }
  if (pair.yaw_known) {
    sums.turn_odometry += beyond_noise(pair.odometry.z());
    sums.turn_scans += beyond_noise(pair.scans.z());
    sums.total_odometry.z() += pair.odometry.z();
    sums.total_scans.z() += pair.scans.z();
  }
}

double lever_square(double along, double turn) {
  return squared(along) + squared(MotionComparison::kLever * turn);
}

}  // namespace

const char* to_string(OdometryFault fault) {
  switch (fault) {
    case OdometryFault::none:
      return "none";
    case OdometryFault::frozen:
      return "frozen";
    case OdometryFault::slipping:
      return "slipping";
    case OdometryFault::carried:
      return "carried";
    case OdometryFault::reversed:
      return "reversed";
    case OdometryFault::translation_reversed:
      return "translation_reversed";
    case OdometryFault::rotation_reversed:
      return "rotation_reversed";
    case OdometryFault::wheel:
      return "wheel";
    case OdometryFault::scale:
      return "scale";
    case OdometryFault::delayed:
      return "delayed";
    case OdometryFault::stamps_frozen:
      return "stamps_frozen";
    case OdometryFault::stamps_jumped:
      return "stamps_jumped";
    case OdometryFault::silent:
      return "silent";
    case OdometryFault::laser_frozen:
      return "laser_frozen";
    case OdometryFault::beam_order:
      return "beam_order";
    case OdometryFault::inconsistent:
      return "inconsistent";
  }
  return "unknown";
}

const char* advice(OdometryFault fault) {
  switch (fault) {
    case OdometryFault::none:
      return "odometry and scans agree";
    case OdometryFault::frozen:
      return "odometry stands still while the robot drives: check the encoders and the odometry process";
    case OdometryFault::slipping:
      return "odometry moves while the robot stands: the wheels slip or turn in the air";
    case OdometryFault::carried:
      return "the robot moves as its wheels cannot: it is carried or pushed";
    case OdometryFault::reversed:
      return "odometry drives and turns the wrong way: change the sign of both wheels; if it was always so, "
             "the laser may be mounted backward and upside down";
    case OdometryFault::translation_reversed:
      return "odometry drives forward where scans go backward: change the sign of its translation; if it was "
             "always so, the laser may be mounted backward";
    case OdometryFault::rotation_reversed:
      return "odometry turns the wrong way: change the sign of its rotation or swap left and right wheel; if "
             "it was always so, the laser may be mounted upside down";
    case OdometryFault::wheel:
      return "one wheel counts wrongly: check its encoder and gear";
    case OdometryFault::scale:
      return "odometry has a wrong scale: parhelion calibrate finds it";
    case OdometryFault::delayed:
      return "odometry is correct but its stamps are offset in time: parhelion calibrate finds the offset";
    case OdometryFault::stamps_frozen:
      return "new poses of odometry have an old stamp: check its clock";
    case OdometryFault::stamps_jumped:
      return "stamps of odometry are not on the clock of the scans: synchronise the clocks";
    case OdometryFault::silent:
      return "no odometry arrives: check its process and the bus";
    case OdometryFault::laser_frozen:
      return "the laser repeats one scan while odometry moves: check its driver";
    case OdometryFault::beam_order:
      return "the laser measures the beams of a message in another order than described: change "
             "beam_interval";
    case OdometryFault::inconsistent:
      return "odometry contradicts the scans: check encoders, wheels and the laser's mounting";
  }
  return "";
}

bool MotionComparison::position_excited() const { return path_scans > kEnoughPath; }
bool MotionComparison::yaw_excited() const { return turn_scans > kEnoughTurn; }

bool MotionComparison::totals_differ() const {
  const Eigen::Vector3d off = total_odometry - total_scans;
  return off.head<2>().norm() > kTolerated * std::max(path_odometry, path_scans) ||
         std::abs(off.z()) > kTolerated * std::max({turn_odometry, turn_scans, kEnoughTurn});
}

std::string MotionComparison::figures() const {
  char text[160];
  std::snprintf(text, sizeof text,
                "in %.1f s odometry %+.2f m and %+.1f degrees, scans %+.2f m and %+.1f degrees", seconds,
                total_odometry.x(), total_odometry.z() * kDegrees, total_scans.x(),
                total_scans.z() * kDegrees);
  return text;
}

MotionComparison compare(std::span<const MotionPair> pairs) {
  MotionComparison result;
  Row along(1, 1, 0, 0.3), turn(0, 3, 1, 1);
  int alongs = 0, turns = 0;
  for (const MotionPair& pair : pairs) {
    add_sums(pair, result);
    if (!pair.yaw_known) continue;
    turn.add(pair.odometry.z(), pair.position_known ? pair.scans.x() : pair.odometry.x(), pair.scans.z());
    ++turns;
    if (!pair.position_known) continue;
    along.add(pair.odometry.x(), pair.scans.x(), pair.scans.z());
    ++alongs;
  }
  result.gain.row(0) = along.solution();
  result.gain.row(1) = turn.solution();
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();
  for (const MotionPair& pair : pairs) {
    if (!pair.yaw_known) continue;
    const Eigen::Vector2d odometry(pair.position_known ? pair.odometry.x() : 0, pair.odometry.z());
    const Eigen::Vector2d scans(pair.position_known ? pair.scans.x() : 0, pair.scans.z());
    const Eigen::Vector2d off = odometry - scans;
    Eigen::Vector2d left = odometry - result.gain * scans;
    if (!pair.position_known) left.x() = 0;
    result.motion += std::max(lever_square(odometry.x(), odometry.y()), lever_square(scans.x(), scans.y()));
    result.contradiction += lever_square(off.x(), off.y());
    result.misfit += lever_square(left.x(), left.y());
    squares += left.cwiseAbs2();
  }
  if (turns == 0) return result;
  result.motion /= turns;
  result.contradiction /= turns;
  result.misfit /= turns;
  result.gain_sigma.row(0) = along.sigma(alongs > 0 ? squares.x() / alongs : 0);
  result.gain_sigma.row(1) = turn.sigma(squares.y() / turns);
  return result;
}

namespace {

/// One of the motions is missing.
std::optional<OdometryFault> missing_motion(const MotionComparison& comparison) {
  constexpr double enough = 0.5;  // m
  const auto& c = comparison;
  const double odometry = c.path_odometry + MotionComparison::kLever * c.turn_odometry;
  const double scans = c.path_scans + MotionComparison::kLever * c.turn_scans;
  if (scans > enough && odometry < 0.1 * scans) {
    const bool sideways = c.path_scans > enough / 2 && c.across > 0.35 * c.path_scans;
    return sideways ? OdometryFault::carried : OdometryFault::frozen;
  }
  if (odometry > enough && scans < 0.2 * odometry) return OdometryFault::slipping;
  return std::nullopt;
}

/// Enough motion for a statement about a factor, which needs more evidence than a sign. On the spot, a laser
/// that is mounted elsewhere than described moves, too: that is no path of odometry's.
bool far(const MotionComparison& comparison) {
  return std::min(comparison.path_scans, 2 * comparison.path_odometry) > kPathForFactor;
}
bool wide(const MotionComparison& comparison) { return comparison.turn_scans > kTurnForFactor; }

/// A systematic error that is significant on its own, even where it is small beside the rest of the motion: a
/// robot that drives straight on turns little, and the wrong way.
std::optional<OdometryFault> by_gain(const MotionComparison& comparison) {
  constexpr double significant = 4;  // sigma
  const auto negative = [&](int i) {
    return comparison.gain(i, i) < -0.4 &&
           comparison.gain(i, i) + significant * comparison.gain_sigma(i, i) < 0;
  };
  const bool backward = comparison.position_excited() && negative(0);
  const bool mirrored = comparison.yaw_excited() && negative(1);
  if (backward && mirrored) return OdometryFault::reversed;
  if (backward) return OdometryFault::translation_reversed;
  if (mirrored) return OdometryFault::rotation_reversed;
  constexpr double crossed_enough = 0.35;  // rad/m: a wheel that is 15 % off on a robot 0.4 m wide
  const double crossed = std::abs(comparison.gain(1, 0));
  if (far(comparison) && crossed > crossed_enough && crossed > significant * comparison.gain_sigma(1, 0))
    return OdometryFault::wheel;
  // On an even curve both motions are nearly one, and errors of either turn into a gain: the way itself has
  // to be wrong, too, by half at least of what is tolerated.
  const double of_path = comparison.path_odometry / std::max(comparison.path_scans, kNoise),
               of_turn = comparison.turn_odometry / std::max(comparison.turn_scans, kNoise);
  const auto scaled = [&](int i) {
    if (std::abs((i == 0 ? of_path : of_turn) - 1) < kToleratedScale / 2) return false;
    const double gain = comparison.gain(i, i), off = std::abs(gain - 1);
    const double sigma = comparison.gain_sigma(i, i);
    return gain > 0.25 && off - sigma > kToleratedScale && off > significant * sigma;
  };
  if ((far(comparison) && scaled(0)) || (wide(comparison) && scaled(1))) return OdometryFault::scale;
  return std::nullopt;
}

}  // namespace

std::optional<OdometryFault> fault_of(const MotionComparison& comparison) {
  if (const auto missing = missing_motion(comparison)) return missing;
  if (!comparison.position_excited() && !comparison.yaw_excited()) return std::nullopt;
  if (const auto systematic = by_gain(comparison)) return systematic;
  const double tolerated = std::max(squared(2 * kNoise), squared(kTolerated) * comparison.motion);
  if (comparison.contradiction < tolerated) return OdometryFault::none;
  // Some other motion than the odometry of this robot, or of another instant.
  constexpr double explained = 0.3;
  const bool other = comparison.misfit > explained * comparison.contradiction;
  if (!other && !far(comparison) && !wide(comparison)) return std::nullopt;
  return OdometryFault::inconsistent;
}

}  // namespace parhelion::pose
