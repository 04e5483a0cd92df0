#include "fusion/pose/mrpt/engine/engine.hpp"

#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/random/RandomGenerators.h>

#include <exception>
#include <numbers>

#include "fusion/pose/estimate.hpp"
#include "fusion/pose/matching/scan_points.hpp"
#include "fusion/pose/mrpt/conversion.hpp"

namespace parhelion::pose {
namespace {

/// 1 sigma of position, m: wider is lost, or, before it was narrower, not found yet.
constexpr double kLostSigma = 0.5;

mrpt::obs::CActionCollection action_of(const RobotDescription& robot, const Pose2& step, SensorTime stamp) {
  mrpt::obs::CActionRobotMovement2D::TMotionModelOptions model;
  model.modelSelection = mrpt::obs::CActionRobotMovement2D::mmGaussian;
  constexpr double kRadian = std::numbers::pi / 180;
  const double position = robot.odometry_error_translation, yaw = robot.odometry_error_rotation;
  // a1: m/m, a2: m/deg, a3: deg/m, a4: deg/deg.
  model.gaussianModel.a1 = position;
  model.gaussianModel.a2 = 0.1 * yaw * kRadian;
  model.gaussianModel.a3 = yaw / kRadian * 0.5;
  model.gaussianModel.a4 = yaw;
  model.gaussianModel.minStdXY = 0.002;
  model.gaussianModel.minStdPHI = 0.1 * kRadian;
  mrpt::obs::CActionRobotMovement2D movement;
  movement.timestamp = mrpt::Clock::fromDouble((stamp - SensorTime{}).seconds());
  movement.computeFromOdometry({step.x, step.y, step.yaw}, model);
  mrpt::obs::CActionCollection collection;
  collection.insert(movement);
  return collection;
}

bool usable(const PlanarPosterior& posterior) {
  return posterior.T_map_base.finite() && posterior.covariance.allFinite();
}

}  // namespace

PlanarPosterior planar_posterior(const mrpt::poses::CPose3DPDF& pdf) {
  const auto [covariance, mean] = pdf.getCovarianceAndMean();
  constexpr int kPlanar[] = {0, 1, 3};
  PlanarPosterior result;
  result.T_map_base = {mean.x(), mean.y(), mean.yaw()};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) result.covariance(i, j) = covariance(kPlanar[i], kPlanar[j]);
  }
  return result;
}

PlanarPosterior planar_posterior(const mrpt::poses::CPosePDF& pdf) {
  const auto [covariance, mean] = pdf.getCovarianceAndMean();
  return {{mean.x(), mean.y(), mean.phi()}, covariance.asEigen()};
}

void silence(mrpt::system::COutputLogger& logger) {
  logger.setMinLoggingLevel(mrpt::system::LVL_ERROR);
  logger.logging_enable_console_output = false;
}

void seed_mrpt(std::uint64_t seed) {
  // randomize() would keep a normal sample that the generator has in store.
  mrpt::random::getRandomGenerator() = mrpt::random::CRandomGenerator(static_cast<std::uint32_t>(seed));
}

MrptEngine::MrptEngine(const RobotDescription& robot)
    : robot_(robot), odometry_(robot.odometry), attitude_(robot.imu) {}

std::optional<PoseEstimate> MrptEngine::add(const Scan& scan) {
  const auto attitude = attitude_.at(scan.stamp);
  const auto step = odometry_.step_to(scan, *robot_.laser, attitude);
  if (!step || scan.ranges.size() < 2) return std::nullopt;
  const LaserDescription& laser = *robot_.laser;
  const ScanPoints points = deskewed(scan, laser, step->sweep, attitude);
  SlamState state = SlamState::tracking;
  try {
    mrpt::obs::CSensoryFrame frame;
    frame.insert(to_mrpt(MappedScan{
        {}, laser.T_base_laser, rectified(points, laser), static_cast<double>(laser.convention.range_max)}));
    auto action = action_of(robot_, step->step, scan.stamp);
    const PlanarPosterior now = process(action, frame);
    if (!usable(now)) throw std::runtime_error("the posterior is not finite");
    last_ = now;
  } catch (const std::exception&) {
    state = SlamState::lost;
    last_.T_map_base = last_.T_map_base * step->step;
  }
  const double sigma = std::sqrt(std::max(last_.covariance(0, 0), last_.covariance(1, 1)));
  if (!step->known || sigma > kLostSigma) state = SlamState::lost;
  found_ = found_ || state == SlamState::tracking;
  if (!found_) state = SlamState::initializing;
  PoseEstimate estimate = planar_estimate(scan.stamp, last_.T_map_base, last_.covariance, state);
  made(estimate);
  return estimate;
}

}  // namespace parhelion::pose
