#include <algorithm>

#include "fusion/pose/calibration/drive_motion.hpp"

namespace parhelion::pose {
namespace {

constexpr Duration kMaxGap = milliseconds(500);

}  // namespace

OdometryPath::OdometryPath(const std::vector<Odometry>& odometry) {
  for (const Odometry& each : odometry) {
    const Pose2 pose = planar(each.T_odom_base);
    if (pose.finite() && (samples_.empty() || each.stamp > samples_.back().stamp)) {
      samples_.push_back({each.stamp, pose});
    } else {
      ++left_out_;
    }
  }
}

std::optional<Pose2> OdometryPath::at(SensorTime t) const {
  const auto after = std::lower_bound(samples_.begin(), samples_.end(), t,
                                      [](const Sample& sample, SensorTime s) { return sample.stamp < s; });
  if (after == samples_.end()) return std::nullopt;
  if (after->stamp == t) return after->T_odom_base;
  if (after == samples_.begin()) return std::nullopt;
  const Sample& before = *(after - 1);
  if (after->stamp - before.stamp > kMaxGap) return std::nullopt;
  const double s = (t - before.stamp).seconds() / (after->stamp - before.stamp).seconds();
  return interpolate(before.T_odom_base, after->T_odom_base, s);
}

std::optional<Pose2> OdometryPath::step(SensorTime from, SensorTime to) const {
  const auto a = at(from), b = at(to);
  if (!a || !b) return std::nullopt;
  return a->inverse() * *b;
}

}  // namespace parhelion::pose
