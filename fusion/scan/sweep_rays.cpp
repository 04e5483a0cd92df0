#include "fusion/scan/sweep_rays.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::scan {
namespace {

/// Sine and 1 - cosine. Rotations during a sweep are small: Taylor's series is exact to the last bit or two
/// below a quarter radian.
void sine_and_versine(double phi, double& sine, double& versine) {
  if (std::abs(phi) > 0.25) {
    const double half = std::sin(phi / 2);
    sine = std::sin(phi);
    versine = 2 * half * half;
    return;
  }
  const double x = phi * phi;
  sine = phi * (1 - x / 6 * (1 - x / 20 * (1 - x / 42 * (1 - x / 72 * (1 - x / 110 * (1 - x / 156))))));
  versine = x / 2 * (1 - x / 12 * (1 - x / 30 * (1 - x / 56 * (1 - x / 90 * (1 - x / 132)))));
}

}  // namespace

RotationSweep::RotationSweep(const Eigen::Matrix3d& R_start, const Eigen::Matrix3d& R_end)
    : R_start_(R_start) {
  if (R_start == R_end) return;
  Eigen::Quaterniond q = Eigen::Quaterniond(R_start).conjugate() * Eigen::Quaterniond(R_end);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  if (sine == 0) return;
  axis_ = q.vec() / sine;
  angle_ = 2 * std::atan2(sine, q.w());
  Eigen::Matrix3d K;
  K << 0, -axis_.z(), axis_.y(), axis_.z(), 0, -axis_.x(), -axis_.y(), axis_.x(), 0;
  across_ = R_start * K;
  back_ = across_ * K;
}

Eigen::Matrix3d RotationSweep::at(double s) const {
  if (angle_ == 0) return R_start_;
  // Rodrigues' formula, with 1 - cos in a form without cancellation.
  double sine = 0, versine = 0;
  sine_and_versine(s * angle_, sine, versine);
  return R_start_ + sine * across_ + versine * back_;
}

bool SweepRays::holds_angles(const BeamSet& beams) const {
  return direction_laser_.size() == beams.time.size() && angle_min_ == beams.angle_min &&
         angle_increment_ == beams.angle_increment &&
         std::equal(angles_.begin(), angles_.end(), beams.angles.begin(), beams.angles.end());
}

void SweepRays::set_angles(const BeamSet& beams) {
  if (holds_angles(beams)) return;
  angle_min_ = beams.angle_min;
  angle_increment_ = beams.angle_increment;
  angles_.assign(beams.angles.begin(), beams.angles.end());
  direction_laser_.resize(beams.time.size());
  for (std::size_t i = 0; i < direction_laser_.size(); ++i) {
    const double angle = beams.angle(i);
    direction_laser_[i] = {std::cos(angle), std::sin(angle), 0};
  }
}

bool SweepRays::holds(const LaserMotion& laser, const BeamSet& beams) const {
  return holds_angles(beams) &&
         std::equal(time_.begin(), time_.end(), beams.time.begin(), beams.time.end()) &&
         laser.T_map_laser_start.isometry().matrix() == T_start_ &&
         laser.T_map_laser_end.isometry().matrix() == T_end_;
}

void SweepRays::set(const LaserMotion& laser, const BeamSet& beams) {
  if (holds(laser, beams)) return;
  const std::size_t n = beams.time.size();
  set_angles(beams);
  T_start_ = laser.T_map_laser_start.isometry().matrix();
  T_end_ = laser.T_map_laser_end.isometry().matrix();
  const RotationSweep rotation(laser.T_map_laser_start.rotation(), laser.T_map_laser_end.rotation());
  start_ = laser.T_map_laser_start.translation();
  end_ = laser.T_map_laser_end.translation();
  R_map_middle_ = rotation.at(0.5);
  half_turn_ = rotation.angle() / 2;
  half_tilt_ = half_turn_ * rotation.axis().head<2>().norm();
  time_.assign(beams.time.begin(), beams.time.end());
  origin_.resize(n);
  direction_.resize(n);
  const Eigen::Vector3d moved = end_ - start_;
  for (std::size_t i = 0; i < n; ++i) {
    origin_[i] = start_ + time(i) * moved;
    direction_[i] = rotation.at(time(i)) * direction_laser_[i];
  }
}

}  // namespace parhelion::scan
