#include <algorithm>

#include "fusion/pose/calibration/motion_chain.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::pose {
namespace {

double rms(const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

}  // namespace

MotionCheck check_motion(const DriveMotion& drive, const MotionParameters& parameters,
                         double window_seconds) {
  const MotionChain chain = motion_chain(drive);
  std::vector<double> position, yaw;
  for (std::size_t first = 0; first + 1 < chain.laser.size(); ++first) {
    Pose2 by_odometry, by_laser;
    std::size_t i = first;
    const SensorTime end = chain.laser[first].stamp + seconds(window_seconds);
    bool known = true;
    for (; known && i + 1 < chain.laser.size() && chain.laser[i + 1].stamp <= end; ++i) {
      const auto step = chain.step(i, parameters);
      known = step.has_value();
      if (!known) break;
      by_odometry = by_odometry * *step;
      by_laser = by_laser * chain.laser_step(i, parameters);
    }
    // Windows that a stop or the end of the drive cuts short compare too little.
    if (!known || (chain.laser[i].stamp - chain.laser[first].stamp).seconds() < 0.7 * window_seconds)
      continue;
    const Pose2 error = by_odometry.inverse() * by_laser;
    position.push_back(error.position().norm());
    yaw.push_back(std::abs(error.yaw));
  }
  if (position.empty()) return {};
  return {position.size(), rms(position), quantile(position, 0.95), rms(yaw), quantile(yaw, 0.95)};
}

ReckonedPath reckoned_path(const DriveMotion& drive, const MotionParameters& parameters) {
  const MotionChain chain = motion_chain(drive);
  ReckonedPath path;
  for (std::size_t i = 0; i < chain.laser.size(); ++i) {
    path.by_laser.push_back(chain.laser[i].T_map_laser * parameters.T_base_laser.inverse());
    const auto step = i > 0 ? chain.step(i - 1, parameters) : std::nullopt;
    // Where odometry is unknown the path goes on from the laser's pose.
    path.by_odometry.push_back(step ? path.by_odometry.back() * *step : path.by_laser.back());
  }
  return path;
}

}  // namespace parhelion::pose
