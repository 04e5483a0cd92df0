#include "fusion/pose/attitude_track.hpp"

#include <cmath>
#include <numbers>

namespace parhelion {
namespace {

constexpr std::size_t slots = 2048;  // two seconds at 1 kHz
constexpr Duration clock_restart = seconds(2.0);
constexpr double steepest = 80 * std::numbers::pi / 180;

}  // namespace

Transform<Map, Base> with_attitude(const Transform<Map, Base>& T_map_base, const Attitude& attitude) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Eigen::Quaterniond rotation = AngleAxisd(T_map_base.yaw(), Vector3d::UnitZ()) *
                                      AngleAxisd(attitude.pitch, Vector3d::UnitY()) *
                                      AngleAxisd(attitude.roll, Vector3d::UnitX());
  return {rotation, T_map_base.translation()};
}

AttitudeTrack::AttitudeTrack(const std::optional<ImuDescription>& imu) : samples_(imu ? slots : 1) {
  if (imu) R_imu_base_ = imu->T_base_imu.quaternion().conjugate();
}

bool AttitudeTrack::add(const ImuSample& sample) {
  if (!R_imu_base_ || !sample.orientation || !sample.orientation->coeffs().allFinite()) return false;
  const Eigen::Matrix3d R = (*sample.orientation * *R_imu_base_).toRotationMatrix();
  const Attitude attitude{std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2)))};
  if (std::abs(attitude.pitch) > steepest) return false;
  if (samples_.count() > 0 && sample.stamp <= samples_.newest().stamp) {
    if (samples_.newest().stamp - sample.stamp <= clock_restart) return false;
    samples_.clear();
  }
  samples_.push({sample.stamp, attitude});
  return true;
}

std::optional<Attitude> AttitudeTrack::at(SensorTime t) const {
  const std::size_t age = samples_.age_at(t);
  if (age == samples_.count()) return std::nullopt;
  const Sample& before = samples_.newest(age);
  if (age == 0) {
    if (t - before.stamp > longest_gap) return std::nullopt;
    return before.attitude;
  }
  const Sample& after = samples_.newest(age - 1);
  if (after.stamp - before.stamp > longest_gap) return std::nullopt;
  const double s = (t - before.stamp).seconds() / (after.stamp - before.stamp).seconds();
  const double roll = wrap_angle(after.attitude.roll - before.attitude.roll);
  const double pitch = after.attitude.pitch - before.attitude.pitch;
  return Attitude{wrap_angle(before.attitude.roll + s * roll), before.attitude.pitch + s * pitch};
}

}  // namespace parhelion
