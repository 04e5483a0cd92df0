#include "fusion/pose/calibration/motion_calibration.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "fusion/pose/calibration/motion_chain.hpp"

namespace parhelion::pose {
namespace {

using P = MotionParameter;
using Free = std::array<bool, kMotionParameters>;
using Sigmas = std::array<double, kMotionParameters>;

constexpr std::size_t kMinPoses = 30;
constexpr double kMinDriven = 1, kMinTurned = 0.5;  ///< m, rad: less shows nothing
constexpr std::size_t kBlocks = 10;
constexpr double kWeakOdometry = 0.15;  ///< m/m, rad/rad

/// A quantity known worse than this (1 sigma) would make the description worse, not better: it is about what
/// a tape measure and a data sheet give.
constexpr Sigmas kUseful{0.02, 0.02, 0.02, 0.03, 0.03, 0.0175, 0.02, 1e9, 1e9, 1e9, 0.05};

constexpr std::array<const char*, kMotionParameters> kNames{
    "translation scale", "rotation scale", "curvature",   "laser x",       "laser y",         "laser yaw",
    "time offset",       "reference x",    "reference y", "reference yaw", "reference offset"};

constexpr std::array<const char*, kMotionParameters> kWhichDrive{
    "drive several metres straight, in view of walls on more than two sides",
    "turn on the spot by a full turn and back",
    "drive ten metres straight, in both directions",
    "turn on the spot, or drive tight curves, both ways",
    "turn on the spot, or drive tight curves, both ways",
    "drive several metres straight, forwards",
    "start, stop and turn briskly, ten times or more",
    "",
    "",
    "",
    "start, stop and turn briskly, ten times or more"};

std::size_t index(P parameter) { return static_cast<std::size_t>(parameter); }

Sigmas sigmas_of(const MotionFit& fit) {
  Sigmas sigmas{};
  const auto covariance = fit.information.inverse().eval();
  for (std::size_t k = 0; k < kMotionParameters; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    sigmas[k] = std::sqrt(std::max(0.0, covariance(i, i)));
  }
  return sigmas;
}

/// The spread of fits that each leave out a tenth of the drive (delete-a-group jackknife): errors of poses
/// that last for many scans, as those of a map, are in it.
Sigmas jackknife(const MotionChain& chain, const MotionFit& fit, const Free& free) {
  std::vector<MotionParameters> each;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    const std::size_t n = chain.laser.size();
    const MotionChain rest = without(chain, b * n / kBlocks, (b + 1) * n / kBlocks);
    if (const auto fitted = fit_motion(rest, fit.parameters, free, 3)) each.push_back(fitted->parameters);
  }
  Sigmas sigmas{};
  const auto count = static_cast<double>(each.size());
  for (std::size_t k = 0; k < kMotionParameters && !each.empty(); ++k) {
    double mean = 0, squares = 0;
    for (const MotionParameters& p : each) mean += p[static_cast<P>(k)] / count;
    for (const MotionParameters& p : each) squares += std::pow(p[static_cast<P>(k)] - mean, 2);
    sigmas[k] = std::sqrt((count - 1) / count * squares);
  }
  return sigmas;
}

/// The free parameter that is known worst, where it is worse than useful.
std::optional<std::size_t> worst(const Sigmas& sigmas, const Free& free) {
  std::optional<std::size_t> found;
  double largest = 1;
  for (std::size_t k = 0; k < kMotionParameters; ++k) {
    const double ratio = sigmas[k] / kUseful[k];
    if (free[k] && !(ratio <= largest)) largest = ratio, found = k;
  }
  return found;
}

struct Fitted {
  MotionFit fit;
  Sigmas sigmas;
  Free free;
};

/// Fixes what the drive does not show, one quantity after the other, as it drags others along.
std::optional<Fitted> fit_what_is_shown(const MotionChain& chain, const MotionParameters& start) {
  Free free;
  free.fill(true);
  if (chain.reference.empty())
    for (const P each : {P::reference_x, P::reference_y, P::reference_yaw, P::reference_offset})
      free[index(each)] = false;
  MotionParameters rough = rough_start(chain, start);
  for (;;) {
    auto fit = fit_motion(chain, rough, free);
    if (!fit) return std::nullopt;
    Sigmas sigmas = sigmas_of(*fit);
    if (!worst(sigmas, free)) {
      const Sigmas spread = jackknife(chain, *fit, free);
      for (std::size_t k = 0; k < kMotionParameters; ++k) sigmas[k] = std::max(sigmas[k], spread[k]);
    }
    const auto unseen = worst(sigmas, free);
    if (!unseen) return Fitted{*fit, sigmas, free};
    free[*unseen] = false;
    rough[static_cast<P>(*unseen)] = start[static_cast<P>(*unseen)];
  }
}

Status check_drive(const MotionChain& chain, const DriveMotion& drive, MotionCalibration& result) {
  result.poses = chain.laser.size();
  result.references = chain.reference.size();
  result.left_out = chain.odometry.left_out();
  for (std::size_t i = 0; i + 1 < chain.laser.size(); ++i) {
    const Pose2 step = chain.laser[i].T_map_laser.inverse() * chain.laser[i + 1].T_map_laser;
    result.driven += step.position().norm();
    result.turned += std::abs(step.yaw);
  }
  const std::string seen = std::to_string(chain.laser.size()) + " poses of the laser in motion";
  if (chain.odometry.samples() < kMinPoses) {
    return Error{std::to_string(chain.odometry.samples()) + " samples of odometry can be used of " +
                 std::to_string(drive.odometry.size()) + "; " + std::to_string(kMinPoses) + " are needed"};
  }
  if (chain.laser.size() < kMinPoses)
    return Error{seen + "; " + std::to_string(kMinPoses) + " are needed: drive for longer"};
  if (result.driven < kMinDriven && result.turned < kMinTurned) {
    return Error{"the robot hardly moves, " + std::to_string(result.driven) +
                 " m in all: drive straight and turn, in view of walls"};
  }
  return {};
}

Status count_steps(const MotionChain& chain, const MotionFit& fit, MotionCalibration& result) {
  const MotionNoise& noise = fit.noise;
  for (std::size_t i = 0; i + 1 < chain.laser.size(); ++i) {
    const auto step = chain.step(i, fit.parameters);
    if (!step) continue;
    ++result.steps;
    if (const auto raw = chain.raw_step(i, fit.parameters))
      (raw->x > 0 ? result.forward : result.backward) += std::abs(raw->x);
    const Pose2 error = step->inverse() * fit.poses[i].inverse() * fit.poses[i + 1];
    const double chi2 = std::pow(error.x / noise.along, 2) + std::pow(error.y / noise.across, 2) +
                        std::pow(error.yaw / noise.turn, 2);
    if (chi2 > 25) ++result.outliers;
  }
  if (result.steps >= kMinPoses / 2) return {};
  return Error{"odometry is known at both ends of " + std::to_string(result.steps) + " steps of " +
               std::to_string(chain.laser.size()) + " scans only: are their stamps of one clock?"};
}

void advise(MotionCalibration& result) {
  for (std::size_t k = 0; k < kMotionParameters; ++k) {
    if (result.measured[k].shown || std::string(kWhichDrive[k]).empty()) continue;
    if (k == index(P::reference_offset) && result.references == 0) continue;
    result.advice.push_back(std::string(kNames[k]) + " is not shown by this drive: " + kWhichDrive[k]);
  }
}

/// The sigmas of the fit are linear in the yaw; where it is not shown it may be wrong by more.
void carry_yaw(MotionCalibration& result) {
  const Measured& yaw = result[P::laser_yaw];
  if (yaw.shown) return;
  for (const P parameter : {P::laser_x, P::laser_y}) {
    Measured& measured = result.measured[index(parameter)];
    // RMS of p (1 - cos yaw), for a normal yaw.
    measured.sigma = std::hypot(measured.sigma, 0.87 * measured.value * yaw.sigma * yaw.sigma);
  }
}

}  // namespace

const char* to_string(MotionParameter parameter) { return kNames[index(parameter)]; }

double& MotionParameters::operator[](MotionParameter parameter) {
  switch (parameter) {
    case P::translation_scale:
      return odometry.translation_scale;
    case P::rotation_scale:
      return odometry.rotation_scale;
    case P::curvature:
      return odometry.curvature;
    case P::laser_x:
      return T_base_laser.x;
    case P::laser_y:
      return T_base_laser.y;
    case P::laser_yaw:
      return T_base_laser.yaw;
    case P::time_offset:
      return odometry.time_offset;
    case P::reference_x:
      return T_reference_map.x;
    case P::reference_y:
      return T_reference_map.y;
    case P::reference_yaw:
      return T_reference_map.yaw;
    case P::reference_offset:
      return reference_offset;
  }
  return reference_offset;
}

double MotionParameters::operator[](MotionParameter parameter) const {
  MotionParameters copy = *this;
  return copy[parameter];
}

void MotionCalibration::add_offset_error(double sigma) {
  double& own = measured[index(P::time_offset)].sigma;
  own = std::hypot(own, sigma);
}

void MotionCalibration::add_jitter_error(double sigma) {
  jitter.sigma = std::hypot(jitter.sigma, sigma);
  jitter.shown = jitter.shown && jitter.value > 2 * jitter.sigma;
}

void MotionCalibration::add_turning_point_error(double width) {
  const double difference = (*this)[P::curvature].value * (*this)[P::translation_scale].value * width;
  Measured& y = measured[index(P::laser_y)];
  y.sigma = std::hypot(y.sigma, difference * width / 4);
}

MotionParameters motion_parameters(const RobotDescription& robot) {
  return {robot.odometry, robot.laser ? planar(robot.laser->T_base_laser) : Pose2{}, {}, 0};
}

RobotDescription with_motion_parameters(RobotDescription robot, const MotionParameters& parameters) {
  robot.odometry = parameters.odometry;
  if (!robot.laser) return robot;
  // Turned about the base's vertical axis, so that a tilt stays what it was relative to the laser.
  const Transform<Base, Laser>& before = robot.laser->T_base_laser;
  Eigen::Vector3d place = before.translation();
  place.head<2>() = parameters.T_base_laser.position();
  const Eigen::AngleAxisd turn(wrap_angle(parameters.T_base_laser.yaw - before.yaw()),
                               Eigen::Vector3d::UnitZ());
  robot.laser->T_base_laser = Transform<Base, Laser>(turn * before.quaternion(), place);
  return robot;
}

RobotDescription with_weak_odometry(RobotDescription robot) {
  robot.odometry_error_translation = std::max(robot.odometry_error_translation, kWeakOdometry);
  robot.odometry_error_rotation = std::max(robot.odometry_error_rotation, kWeakOdometry);
  return robot;
}

Result<MotionCalibration> calibrate_motion(const DriveMotion& drive, const MotionParameters& start) {
  MotionCalibration result;
  const MotionChain chain = motion_chain(drive);
  if (const Status enough = check_drive(chain, drive, result); !enough) return enough.error();
  MotionParameters begin = start;
  if (!chain.reference.empty()) {
    const ReferenceSample& middle = chain.reference[chain.reference.size() / 2];
    begin.T_reference_map = middle.T_reference_base *
                            (chain.laser[middle.node].T_map_laser * start.T_base_laser.inverse()).inverse();
  }
  const auto fitted = fit_what_is_shown(chain, begin);
  if (!fitted) return Error{"odometry and scans cannot be brought together: the equations have no solution"};
  if (const Status counted = count_steps(chain, fitted->fit, result); !counted) return counted.error();
  result.parameters = fitted->fit.parameters;
  result.parameters.T_base_laser.yaw = wrap_angle(result.parameters.T_base_laser.yaw);
  result.noise = fitted->fit.noise;
  for (std::size_t k = 0; k < kMotionParameters; ++k)
    result.measured[k] = {result.parameters[static_cast<P>(k)],
                          fitted->free[k] ? fitted->sigmas[k] : kept_sigma(static_cast<P>(k)),
                          fitted->free[k]};
  carry_yaw(result);
  result.jitter = jitter_of(chain, result.parameters);
  advise(result);
  return result;
}

WheelModel wheel_model(const MotionCalibration& calibration, double track_width) {
  const Measured &forward = calibration[P::translation_scale], &turn = calibration[P::rotation_scale],
                 &curve = calibration[P::curvature];
  // Odometry's v = (l + r) / 2 and w = (r - l) / track_width, and the true ones from the scaled wheels.
  const double track = track_width * forward.value / turn.value;
  const double half = forward.value * curve.value * track / 2;
  const double track_sigma = track * std::hypot(forward.sigma / forward.value, turn.sigma / turn.value);
  const double side_sigma = std::hypot(forward.sigma, curve.sigma * track / 2);
  const bool sides = forward.shown && curve.shown;
  return {{forward.value - half, side_sigma, sides},
          {forward.value + half, side_sigma, sides},
          {track, track_sigma, forward.shown && turn.shown}};
}

}  // namespace parhelion::pose
