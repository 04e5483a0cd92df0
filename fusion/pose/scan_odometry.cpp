#include "fusion/pose/scan_odometry.hpp"

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

}  // namespace

std::optional<ScanOdometry::Step> ScanOdometry::step_to(SensorTime stamp,
                                                        const std::optional<Attitude>& attitude) {
  if (!latest_) return std::nullopt;
  Step result;
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
    result.twist = {along * result.twist.vx, across * result.twist.vy, result.twist.wz};
  }
  return result;
}

}  // namespace parhelion::pose
