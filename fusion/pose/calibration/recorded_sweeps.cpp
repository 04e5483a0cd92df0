#include "fusion/pose/calibration/recorded_sweeps.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/pose/odometry/odometry_correction.hpp"

namespace parhelion::pose {
namespace {

/// Stamps of odometry jitter by some milliseconds: over a shorter span that becomes velocity.
constexpr Duration kShortestSpan = milliseconds(120);
/// Of a sweep, what is left of it in a time offset: 1.0 to 1.5 ms of 67 ms, on the generated drives of
/// calibration_test.cpp.
constexpr double kLeftOver = 0.02;

}  // namespace

RecordedSweeps::RecordedSweeps(const std::vector<Odometry>& odometry, const OdometryCorrection& correction,
                               const LaserDescription& laser, std::size_t beams)
    : path_(odometry), correction_(correction) {
  if (beams > 0) {
    const SweepSpan span = sweep_span(laser, beams);
    begin_ = std::min(begin_, span.begin);
    end_ = std::max(end_, span.end);
  }
  sweep_ = end_ - begin_;
  if (sweep_ < kShortestSpan) {
    const Duration wider{(kShortestSpan - (end_ - begin_)).ns / 2};
    begin_ = begin_ - wider;
    end_ = end_ + wider;
  }
}

// What odometry's noise makes of the headings looks like a motion half a sweep later. It decides about the
// offset by its fraction of the motion, once each round and for headings and positions alike, and not where
// the headings' own noise is larger.
double RecordedSweeps::offset_sigma(const MotionNoise& noise, double step, double rate) const {
  // Chosen so that it covers the errors of eight generated drives with rough odometry: 6 to 13 ms of 67 ms.
  constexpr double kTimes = 20;
  const double half = sweep_.seconds() / 2;
  const double rate_noise2 = noise.turn * noise.turn / (step * (end_ - begin_).seconds());
  const double imprint = rate_noise2 * half * half, own = std::pow(noise.laser_yaw, 2);
  const double fraction =
      std::min(imprint / (imprint + own), kTimes * rate_noise2 / (rate_noise2 + rate * rate));
  return std::hypot(left_over(), half * fraction);
}

double RecordedSweeps::left_over() const { return kLeftOver * sweep_.seconds(); }

std::optional<SweepMotion> RecordedSweeps::at(SensorTime stamp) const {
  const SensorTime from = stamp + begin_ - seconds(correction_.time_offset);
  const Duration half{(end_ - begin_).ns / 2};
  const auto first = path_.step(from, from + half), second = path_.step(from + half, from + half + half);
  if (!first || !second) return std::nullopt;
  const double dt = half.seconds();
  const Twist2 a = twist_between({}, corrected_step(correction_, *first), dt);
  const Twist2 b = twist_between({}, corrected_step(correction_, *second), dt);
  const Twist2 acceleration{(b.vx - a.vx) / dt, (b.vy - a.vy) / dt, (b.wz - a.wz) / dt};
  const double to_stamp = -(begin_ + half).seconds();  // from the middle
  return SweepMotion(
      {(a.vx + b.vx) / 2 + to_stamp * acceleration.vx, (a.vy + b.vy) / 2 + to_stamp * acceleration.vy,
       (a.wz + b.wz) / 2 + to_stamp * acceleration.wz},
      acceleration);
}

}  // namespace parhelion::pose
