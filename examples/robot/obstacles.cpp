#include "obstacles.hpp"

#include <algorithm>
#include <cmath>

#include "description.hpp"

namespace robot {
namespace {

constexpr double kSight = 3;  // m, farther points cannot matter before the next scan

}  // namespace

std::vector<Point2> points_of(const parhelion::planar_lidar_t& scan, const Pose2& T_base_laser,
                              double range_max) {
  std::vector<Point2> points;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double range = scan.ranges[i];
    if (!(range >= kRangeMin && range < range_max)) continue;  // too close, no return, or invalid
    const double angle = scan.rad0 + static_cast<double>(i) * scan.radstep;
    points.push_back(T_base_laser * Point2{range * std::cos(angle), range * std::sin(angle)});
  }
  return points;
}

void ObstacleStop::see_real(const parhelion::planar_lidar_t& scan, std::int64_t now) {
  real_ = {points_of(scan, kLaserPose, kSight), now};
}

void ObstacleStop::see_augmented(const parhelion::planar_lidar_t& scan, std::int64_t now) {
  augmented_ = {points_of(scan, kLaserPose, kSight), now};
}

bool ObstacleStop::sees(std::int64_t now) const {
  return now - std::min(real_.at, augmented_.at) <= kSilence;
}

// Sweeps the footprint along the arc for the reaction and braking time.
bool ObstacleStop::is_free(const Twist2& command) const {
  constexpr double kStep = 0.05;  // s
  const double brakes =
      std::max(std::abs(command.vx) / kDeceleration, std::abs(command.wz) / kYawDeceleration);
  const double horizon = kScanPeriod + kReactionTime + brakes / 2;
  const double reach = kMargin + (std::abs(command.vx) + kRadius * std::abs(command.wz)) * (horizon + kStep);
  for (const Seen* seen : {&real_, &augmented_}) {
    for (const Point2& p : seen->points) {
      const double here = distance(kFootprint, p);
      if (here > reach) continue;
      for (double t = kStep; t < horizon + kStep; t += kStep) {
        const double there = distance(kFootprint, inverse(advance({}, command, t)) * p);
        if (there < kMargin && there < here - 1e-4) return false;
      }
    }
  }
  return true;
}

double ObstacleStop::allowed(const Twist2& command, std::int64_t now) const {
  if (command.vx == 0 && command.wz == 0) return 1;
  if (!sees(now)) return 0;
  for (const double part : {1.0, 0.7, 0.4, 0.2}) {
    if (is_free({part * command.vx, part * command.wz})) return part;
  }
  return 0;
}

}  // namespace robot
