#include "server/tick/imu_model.hpp"

#include "fusion/scan/lidar_model.hpp"
#include "protocols/gravity.hpp"

namespace parhelion::tick {
namespace {

constexpr std::uint64_t kStartStream = 0x696D7530ULL << 32;  // independent of all other draws of a seed
constexpr std::uint64_t kSampleStream = 0x696D7573ULL << 32;
const Eigen::Vector3d kUpForce(0, 0, kGravity);  // m/s^2, specific force at rest

}  // namespace

ImuModel::ImuModel(const ImuDescription& imu, const ImuErrors& errors, std::uint64_t seed)
    : imu_(imu), errors_(errors), seed_(seed) {
  const auto start = [&](std::size_t which) { return scan::standard_normal({seed, kStartStream}, which); };
  rate_bias_ = errors.rate_bias * Eigen::Vector3d(start(0), start(1), start(2));
  acceleration_bias_ = errors.acceleration_bias * Eigen::Vector3d(start(3), start(4), start(5));
  attitude_bias_ = {errors.attitude_bias * start(6), errors.attitude_bias * start(7), 0};
}

double ImuModel::draw(std::size_t which) const {
  return scan::standard_normal({seed_, kSampleStream | samples_}, which);
}

void ImuModel::wander(double dt) {
  const double root = std::sqrt(std::max(dt, 0.0));
  rate_bias_ += errors_.rate_walk * root * draws(6);
  acceleration_bias_ += errors_.acceleration_walk * root * draws(9);
  attitude_bias_.z() = wrap_angle(attitude_bias_.z() + rate_bias_.z() * dt);
}

ImuSample ImuModel::add(SensorTime stamp, const BaseMotion& motion, bool restart) {
  const double dt = samples_ == 0 ? 0 : (stamp - last_stamp_).seconds();
  ++samples_;
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero(), turning = Eigen::Vector3d::Zero();
  if (dt > 0 && !restart) {
    acceleration = (motion.velocity - last_.velocity) / dt;
    turning = (motion.rotation_rate - last_.rotation_rate) / dt;
  }
  wander(dt);
  last_stamp_ = stamp;
  last_ = motion;

  // Acceleration of a point at r from the base: a + alpha x r + omega x (omega x r).
  const Eigen::Matrix3d R_map_base = motion.T_map_base.rotation();
  const Eigen::Vector3d r = R_map_base * imu_.T_base_imu.translation(), w = motion.rotation_rate;
  acceleration += turning.cross(r) + w.cross(w.cross(r));
  const Eigen::Matrix3d R_map_imu = R_map_base * imu_.T_base_imu.rotation();
  ImuSample sample;
  sample.stamp = stamp;
  sample.rotation_rate = R_map_imu.transpose() * w + rate_bias_ + errors_.rate_noise * draws(0);
  sample.acceleration = R_map_imu.transpose() * (acceleration + kUpForce) + acceleration_bias_ +
                        errors_.acceleration_noise * draws(3);
  const Eigen::Vector3d off(attitude_bias_.x() + errors_.attitude_noise * draw(12),
                            attitude_bias_.y() + errors_.attitude_noise * draw(13), 0);
  const Eigen::Quaterniond tilt(
      Eigen::AngleAxisd(off.norm(), off.norm() > 0 ? off.normalized() : Eigen::Vector3d::UnitX()));
  const Eigen::Quaterniond drift(Eigen::AngleAxisd(attitude_bias_.z(), Eigen::Vector3d::UnitZ()));
  sample.orientation = (drift * Eigen::Quaterniond(R_map_imu) * tilt).normalized();
  return sample;
}

}  // namespace parhelion::tick
