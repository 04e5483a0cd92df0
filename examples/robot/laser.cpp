#include "laser.hpp"

#include <cmath>
#include <limits>

#include "description.hpp"

namespace robot {

void Track::add(std::int64_t utime, const Pose2& T_site_base) {
  poses_.push_back({utime, T_site_base});
  while (poses_.front().utime < utime - 1'000'000) poses_.pop_front();
}

Pose2 Track::at(std::int64_t utime) const {
  std::size_t next = 0;
  while (next < poses_.size() && poses_[next].utime < utime) ++next;
  if (next == 0) return poses_.front().T_site_base;
  if (next == poses_.size()) return poses_.back().T_site_base;
  const Stamped &a = poses_[next - 1], &b = poses_[next];
  const double part = static_cast<double>(utime - a.utime) / static_cast<double>(b.utime - a.utime);
  return {a.T_site_base.x + part * (b.T_site_base.x - a.T_site_base.x),
          a.T_site_base.y + part * (b.T_site_base.y - a.T_site_base.y),
          a.T_site_base.yaw + part * (b.T_site_base.yaw - a.T_site_base.yaw)};
}

namespace {

// The range as the sensor reports it: with noise, rounded, and with its sentinels.
float written(double range, std::mt19937& random) {
  if (!(range < kRangeMax)) return std::numeric_limits<float>::infinity();
  range += std::normal_distribution<double>(0, kRangeNoise)(random);
  if (range < kRangeMin) return 0;
  return static_cast<float>(std::round(range / kRangeStep) * kRangeStep);
}

}  // namespace

parhelion::planar_lidar_t measure_scan(const Building& building, const Track& track, std::int64_t utime,
                                       std::mt19937& random) {
  parhelion::planar_lidar_t scan{};
  scan.utime = utime;
  scan.rad0 = static_cast<float>(kAngleMin);
  scan.radstep = static_cast<float>(kAngleStep);
  scan.nranges = kBeams;
  for (int i = 0; i < kBeams; ++i) {
    const auto later = static_cast<std::int64_t>(std::llround(1e6 * kBeamInterval * i));
    const Pose2 T_site_laser = track.at(utime + later) * kLaserPose;
    const double angle = T_site_laser.yaw + kAngleMin + i * kAngleStep;
    const Hit hit = building.cast({T_site_laser.x, T_site_laser.y, kLaserHeight},
                                  {std::cos(angle), std::sin(angle), 0}, kRangeMax);
    scan.ranges.push_back(written(hit.range, random));
  }
  return scan;
}

}  // namespace robot
