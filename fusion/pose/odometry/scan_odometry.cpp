#include "fusion/pose/odometry/scan_odometry.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::pose {
namespace {

/// Jittered stamps make a twist over a short span far too large, and a long span delays it: the smaller of
/// both is used, as too little deskewing does less harm than too much.
double cautious(double brief, double lasting) {
  if (brief * lasting <= 0) return 0;
  return std::copysign(std::min(std::abs(brief), std::abs(lasting)), brief);
}

/// Over the halves of shorter sweeps, jitter of odometry's stamps becomes velocity.
constexpr Duration kLongSweep = milliseconds(95);
/// Of a sweep: by so much may odometry end before it does.
constexpr double kMissing = 0.25;

}  // namespace

std::optional<ScanOdometry::Step> ScanOdometry::step_to(const Scan& scan, const LaserDescription& laser,
                                                        const std::optional<Attitude>& attitude) {
  if (scan.ranges.empty()) return step_to(scan.stamp, {}, {}, attitude);
  if (!scan.is_timed()) {
    const SweepSpan span = sweep_span(laser, scan.ranges.size());
    return step_to(scan.stamp, span.begin, span.end, attitude);
  }
  const auto [first, last] = std::minmax_element(scan.times.begin(), scan.times.end());
  const std::int64_t stamp = scan.stamp.utime();
  return step_to(scan.stamp, microseconds(*first - stamp), microseconds(*last - stamp), attitude);
}

/// From its beginning to its middle, and from there to its end; the twist changes evenly in between.
std::optional<SweepMotion> ScanOdometry::during(SensorTime stamp, Duration first_beam,
                                                Duration last_beam) const {
  const double half = (last_beam - first_beam).seconds() / 2;
  if (2 * half < kLongSweep.seconds()) return std::nullopt;
  const auto begin = track_.at(stamp + first_beam), middle = track_.at(stamp + first_beam + seconds(half)),
             end = track_.at(stamp + last_beam);
  if (!begin || !middle || !end || end->ahead > kMissing * 2 * half) return std::nullopt;
  const Twist2 before = twist_between(begin->T_odom_base, middle->T_odom_base, half),
               after = twist_between(middle->T_odom_base, end->T_odom_base, half);
  const Twist2 acceleration{(after.vx - before.vx) / half, (after.vy - before.vy) / half,
                            (after.wz - before.wz) / half};
  const double to_stamp = -(first_beam.seconds() + half / 2);  // s, from when it moves as `before`
  return SweepMotion({before.vx + to_stamp * acceleration.vx, before.vy + to_stamp * acceleration.vy,
                      before.wz + to_stamp * acceleration.wz},
                     acceleration);
}

std::optional<ScanOdometry::Step> ScanOdometry::step_to(SensorTime stamp, Duration first_beam,
                                                        Duration last_beam,
                                                        const std::optional<Attitude>& attitude) {
  Step result;
  if (!exists_) {
    result.known = false;
    return result;
  }
  if (!latest_) return std::nullopt;
  const auto there = track_.at(stamp);
  std::optional<Pose2> T_odom_base;
  if (there) {
    T_odom_base = there->T_odom_base;
    constexpr Duration lasting = milliseconds(300);
    if (const auto then = track_.at(stamp - lasting)) {
      const Twist2 mean = twist_between(then->T_odom_base, there->T_odom_base, lasting.seconds());
      result.twist = {cautious(there->twist.vx, mean.vx), cautious(there->twist.vy, mean.vy),
                      cautious(there->twist.wz, mean.wz)};
    }
  }
  result.sweep = result.twist;
  if (const auto known = during(stamp, first_beam, last_beam)) result.sweep = *known;
  if (latest_->stamp == stamp) T_odom_base = planar(latest_->T_odom_base);
  if (!T_odom_base) {
    result.known = false;
    T_odom_base = planar(latest_->T_odom_base);
  }
  if (T_odom_base_) result.step = T_odom_base_->inverse() * *T_odom_base;
  T_odom_base_ = T_odom_base;
  if (attitude) {
    const double along = std::cos(attitude->pitch), across = std::cos(attitude->roll);
    result.step = {along * result.step.x, across * result.step.y, result.step.yaw};
    for (Twist2* twist : {&result.twist, &result.sweep.twist, &result.sweep.acceleration})
      *twist = {along * twist->vx, across * twist->vy, twist->wz};
  }
  result.reported = result.step;
  return result;
}

}  // namespace parhelion::pose
