#include "fusion/pose/tracks/attitude_track.hpp"

#include <cmath>
#include <numbers>

#include "fusion/pose/tracks/bracket.hpp"

namespace parhelion::pose {
namespace {

constexpr std::size_t kSlots = 2048;  // two seconds at 1 kHz
constexpr double kSteepest = 80 * std::numbers::pi / 180;

Eigen::Quaterniond tilt(const Attitude& attitude) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return AngleAxisd(attitude.pitch, Vector3d::UnitY()) * AngleAxisd(attitude.roll, Vector3d::UnitX());
}

}  // namespace

Transform<Base, Laser> levelled(const Transform<Base, Laser>& T_base_laser, const Attitude& attitude) {
  return {tilt(attitude) * T_base_laser.quaternion(), tilt(attitude) * T_base_laser.translation()};
}

Transform<Map, Base> with_attitude(const Transform<Map, Base>& T_map_base, const Attitude& attitude) {
  const Eigen::AngleAxisd heading(T_map_base.yaw(), Eigen::Vector3d::UnitZ());
  return {Eigen::Quaterniond(heading) * tilt(attitude), T_map_base.translation()};
}

AttitudeTrack::AttitudeTrack(const std::optional<ImuDescription>& imu) : samples_(imu ? kSlots : 1) {
  if (!imu) return;
  R_imu_base_ = imu->T_base_imu.quaternion().conjugate();
  time_offset_ = seconds(imu->time_offset);
}

bool AttitudeTrack::add(const ImuSample& sample) {
  if (!R_imu_base_ || !sample.orientation || !sample.orientation->coeffs().allFinite()) return false;
  const Eigen::Matrix3d R = (*sample.orientation * *R_imu_base_).toRotationMatrix();
  const Attitude attitude{std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2)))};
  if (std::abs(attitude.pitch) > kSteepest) return false;
  return push_in_order({sample.stamp + time_offset_, attitude}, samples_);
}

std::optional<Attitude> AttitudeTrack::at(SensorTime t) const {
  const auto found = bracket(samples_, t, kLongestGap);
  if (!found) return std::nullopt;
  const Attitude &before = found->before->attitude, &after = found->after->attitude;
  return Attitude{wrap_angle(before.roll + found->s * wrap_angle(after.roll - before.roll)),
                  before.pitch + found->s * (after.pitch - before.pitch)};
}

}  // namespace parhelion::pose
