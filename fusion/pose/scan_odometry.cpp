#include "fusion/pose/scan_odometry.hpp"

namespace parhelion {

std::optional<ScanOdometry::Step> ScanOdometry::step_to(SensorTime stamp) {
  if (!latest_) return std::nullopt;
  Step result;
  const auto there = track_.at(stamp);
  std::optional<Pose2> T_odom_base;
  if (there) {
    T_odom_base = there->T_odom_base;
    result.twist = there->twist;
  }
  if (latest_->stamp == stamp) T_odom_base = planar(latest_->T_odom_base);
  if (!T_odom_base) {
    result.known = false;
    T_odom_base = planar(latest_->T_odom_base);
  }
  if (T_odom_base_) result.step = T_odom_base_->inverse() * *T_odom_base;
  T_odom_base_ = T_odom_base;
  return result;
}

}  // namespace parhelion
