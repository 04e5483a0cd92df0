#include "fusion/pose/calibration/motion_chain.hpp"

#include <algorithm>
#include <numbers>

#include "fusion/pose/odometry/odometry_correction.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::pose {
namespace {

/// Poses closer together than this, in m and rad, carry no news of motion.
constexpr double kStill = 0.01, kStillTurn = 0.01;

bool moved_on(const LaserPose& last, const LaserPose& now) {
  const Pose2 step = last.T_map_laser.inverse() * now.T_map_laser;
  return step.position().norm() > kStill || std::abs(step.yaw) > kStillTurn;
}

std::vector<LaserPose> moving(const std::vector<LaserPose>& all) {
  std::vector<LaserPose> kept;
  bool linked = true;
  for (const LaserPose& pose : all) {
    linked = linked && pose.linked;
    if (!pose.T_map_laser.finite() || (!kept.empty() && pose.stamp <= kept.back().stamp)) continue;
    if (linked && !kept.empty() && !moved_on(kept.back(), pose)) continue;
    kept.push_back({pose.stamp, pose.T_map_laser, linked});
    linked = true;
  }
  return kept;
}

std::vector<ReferenceSample> paired(const std::vector<PoseStamped>& reference,
                                    const std::vector<LaserPose>& laser) {
  std::vector<ReferenceSample> samples;
  constexpr Duration near = milliseconds(500);
  for (const PoseStamped& each : reference) {
    const auto after = std::upper_bound(laser.begin(), laser.end(), each.stamp,
                                        [](SensorTime t, const LaserPose& pose) { return t < pose.stamp; });
    if (after == laser.begin() || each.stamp - (after - 1)->stamp > near) continue;
    const Pose2 pose = planar(each.T_map_base);
    if (!pose.finite()) continue;
    samples.push_back({static_cast<std::size_t>(after - 1 - laser.begin()), each.stamp, pose});
  }
  return samples;
}

/// Errors of odometry against the laser over `count` steps each, one vector a component.
using Errors = std::array<std::vector<double>, 3>;

Errors window_errors(const MotionChain& chain, const MotionParameters& parameters, std::size_t count) {
  Errors errors;
  for (std::size_t first = 0; first + count < chain.laser.size(); ++first) {
    Pose2 by_odometry, by_laser;
    bool known = true;
    for (std::size_t i = first; known && i < first + count; ++i) {
      const auto step = chain.step(i, parameters);
      known = step.has_value();
      if (!known) break;
      by_odometry = by_odometry * *step;
      by_laser = by_laser * chain.laser_step(i, parameters);
    }
    if (!known) continue;
    const Pose2 error = by_odometry.inverse() * by_laser;
    errors[0].push_back(std::abs(error.x));
    errors[1].push_back(std::abs(error.y));
    errors[2].push_back(std::abs(error.yaw));
  }
  return errors;
}

double robust_variance(std::vector<double> sizes) {
  return sizes.empty() ? 0 : std::pow(1.4826 * median(sizes), 2);
}

/// Variances of one step of odometry and of one pose of the laser.
struct Variances {
  double step = 0, laser = 0;
};

constexpr std::size_t kLongWindow = 10;

Variances variances(const std::vector<double>& one, const std::vector<double>& many) {
  const double v_one = robust_variance(one), v_many = robust_variance(many);
  const double step = (v_many - v_one) / (kLongWindow - 1);
  const double kept = std::clamp(step, 0.01 * v_one, 0.96 * v_one);
  return {kept, (v_one - kept) / 2};
}

}  // namespace

MotionChain motion_chain(const DriveMotion& drive) {
  MotionChain chain;
  chain.laser = moving(drive.laser);
  chain.reference = paired(drive.reference, chain.laser);
  chain.odometry = OdometryPath(drive.odometry);
  return chain;
}

MotionChain without(const MotionChain& chain, std::size_t first, std::size_t last) {
  MotionChain rest = chain;
  const auto begin = rest.laser.begin();
  rest.laser.erase(begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(last));
  if (first < rest.laser.size()) rest.laser[first].linked = false;
  rest.reference.clear();
  for (ReferenceSample sample : chain.reference) {
    if (sample.node >= first && sample.node < last) continue;
    if (sample.node >= last) sample.node -= last - first;
    rest.reference.push_back(sample);
  }
  return rest;
}

std::optional<Pose2> MotionChain::raw_step(std::size_t i, const MotionParameters& parameters) const {
  if (!laser[i + 1].linked) return std::nullopt;
  const Duration offset = seconds(parameters.odometry.time_offset);
  return odometry.step(laser[i].stamp - offset, laser[i + 1].stamp - offset);
}

std::optional<Pose2> MotionChain::step(std::size_t i, const MotionParameters& parameters) const {
  const auto raw = raw_step(i, parameters);
  if (!raw) return std::nullopt;
  return corrected_step(parameters.odometry, *raw);
}

Pose2 MotionChain::laser_step(std::size_t i, const MotionParameters& parameters) const {
  const Pose2& T_base_laser = parameters.T_base_laser;
  return T_base_laser * laser[i].T_map_laser.inverse() * laser[i + 1].T_map_laser * T_base_laser.inverse();
}

std::optional<Eigen::Vector3d> step_error(const MotionChain& chain, std::size_t i,
                                          const MotionParameters& parameters) {
  const auto step = chain.step(i, parameters);
  if (!step) return std::nullopt;
  const Pose2 error = step->inverse() * chain.laser_step(i, parameters);
  return Eigen::Vector3d(error.x, error.y, error.yaw);
}

MotionNoise estimated_noise(const MotionChain& chain, const MotionParameters& parameters,
                            const MotionNoise& before) {
  const Errors one = window_errors(chain, parameters, 1),
               many = window_errors(chain, parameters, kLongWindow);
  const Variances x = variances(one[0], many[0]), y = variances(one[1], many[1]),
                  yaw = variances(one[2], many[2]);
  constexpr double min_position = 5e-4, min_yaw = 2e-4;  // m, rad: numbers on the wire are not finer
  const auto sigma = [](double variance, double floor) { return std::max(std::sqrt(variance), floor); };
  MotionNoise noise = before;
  noise.laser_position = sigma((x.laser + y.laser) / 2, min_position);
  noise.laser_yaw = sigma(yaw.laser, min_yaw);
  noise.along = sigma(x.step, min_position);
  noise.across = sigma(y.step, min_position);
  noise.turn = sigma(yaw.step, min_yaw);
  return noise;
}

MotionParameters rough_start(const MotionChain& chain, const MotionParameters& start) {
  // Bounded, so that neither slip nor a lost scan decides.
  constexpr double kGood = 0.02, kGoodYaw = 0.01, kBad = 25;  // m, rad, squared sigmas
  const std::size_t stride = std::max<std::size_t>(1, chain.laser.size() / 2000);
  const auto cost = [&](const MotionParameters& parameters, bool position) {
    double sum = 0;
    for (std::size_t i = 0; i + 1 < chain.laser.size(); i += stride) {
      const auto step = chain.step(i, parameters);
      const Pose2 laser = chain.laser_step(i, parameters);
      if (!step) {
        sum += kBad;
        continue;
      }
      const double yaw = wrap_angle(step->yaw - laser.yaw) / kGoodYaw;
      // Until the mounting is known, distances only.
      const double apart = position ? (step->position() - laser.position()).norm()
                                    : step->position().norm() - laser.position().norm();
      sum += std::min(kBad, yaw * yaw + apart * apart / (kGood * kGood));
    }
    return sum;
  };
  MotionParameters best = start, each = start;
  double lowest = 0.95 * cost(start, false);
  for (int i = -50; i <= 50; ++i) {
    each.odometry.time_offset = 0.02 * i;
    if (const double here = cost(each, false); here < lowest) lowest = here, best = each;
  }
  each = best;
  lowest = 0.8 * cost(best, true);
  for (int quarter = 1; quarter < 4; ++quarter) {
    each.T_base_laser.yaw = wrap_angle(start.T_base_laser.yaw + quarter * std::numbers::pi / 2);
    if (const double here = cost(each, true); here < lowest) lowest = here, best = each;
  }
  return best;
}

}  // namespace parhelion::pose
