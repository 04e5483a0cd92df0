// Estimates of several sensors at one instant.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>

#include "protocols/time.hpp"

namespace parhelion::people {

inline constexpr double kFusedAcceleration = 0.8;  // m^2/s^3, spectral density, as of a track
inline constexpr double kVelocityLife = 0.5;       // s for which a velocity is believed

/// Moves an estimate to `now` with constant velocity.
template <class Estimate>
void predict(Estimate& estimate, SimulationTime now) {
  const double dt = std::max((now - estimate.stamp).seconds(), 0.0);
  const double moving = std::min(dt, kVelocityLife);
  estimate.position += moving * estimate.velocity;
  Eigen::Matrix4d F = Eigen::Matrix4d::Identity();
  F(0, 2) = F(1, 3) = moving;
  estimate.covariance = F * estimate.covariance * F.transpose();
  for (const int i : {0, 1}) {
    estimate.covariance(i, i) += kFusedAcceleration * dt * dt * dt / 3;
    estimate.covariance(i + 2, i + 2) += kFusedAcceleration * dt;
  }
  estimate.stamp = std::max(estimate.stamp, now);
}

template <class Estimate>
Estimate at(Estimate estimate, SimulationTime now) {
  predict(estimate, now);
  return estimate;
}

/// Squared Mahalanobis distance of two positions; `sigma`: m, of each beside the covariances.
template <class A, class B>
double distance2(const A& a, const B& b, double sigma) {
  Eigen::Matrix2d S =
      a.covariance.template topLeftCorner<2, 2>() + b.covariance.template topLeftCorner<2, 2>();
  S.diagonal().array() += 2 * sigma * sigma;
  const Eigen::Vector2d gap = a.position - b.position;
  return gap.dot(S.inverse() * gap);
}

}  // namespace parhelion::people
