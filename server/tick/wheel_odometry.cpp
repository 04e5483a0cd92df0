#include "server/tick/wheel_odometry.hpp"

#include <cmath>
#include <utility>

#include "fusion/scan/lidar_model.hpp"

namespace parhelion::tick {
namespace {

constexpr std::uint64_t kErrorsStream = 0x6F646F65ULL << 32;  // independent of all other draws of a seed
constexpr std::uint64_t kNoiseStream = 0x6F646F6EULL << 32;

}  // namespace

WheelOdometryErrors draw_wheel_errors(std::uint64_t seed, double translation, double rotation, double track) {
  const scan::NoiseKey key{seed, kErrorsStream};
  WheelOdometryErrors errors;
  // One part of the error per metre is systematic, and an equal part is noise.
  const double fraction = translation / std::sqrt(2.0);
  const double both = fraction * scan::standard_normal(key, 0);
  // A difference of the sides turns the robot by difference / track per metre: a tenth is realistic.
  const double apart = 0.1 * translation * track * scan::standard_normal(key, 1);
  errors.left = both - apart / 2;
  errors.right = both + apart / 2;
  errors.track = rotation / std::sqrt(2.0) * scan::standard_normal(key, 2);
  errors.noise = 0.1 * fraction;
  errors.tick = 1e-4;
  return errors;
}

WheelOdometry::WheelOdometry(double track, const WheelOdometryErrors& errors, std::uint64_t seed)
    : track_(track), errors_(errors), seed_(seed) {}

double WheelOdometry::advance(Side& side, double travelled, double error, std::size_t draw) {
  const double moved = travelled - side.travelled;
  side.travelled = travelled;
  double measured = moved * (1 + error);
  if (moved != 0 && errors_.noise > 0)
    measured += errors_.noise * std::sqrt(std::abs(moved)) *
                scan::standard_normal({seed_, kNoiseStream | samples_}, draw);
  side.measured += measured;
  if (!(errors_.tick > 0)) {
    const double before = std::exchange(side.counted, side.measured);
    return side.counted - before;
  }
  const double counted = errors_.tick * std::floor(side.measured / errors_.tick);
  return counted - std::exchange(side.counted, counted);
}

Odometry WheelOdometry::add(SensorTime stamp, double left, double right, std::uint32_t epoch) {
  if (samples_ == 0 || epoch != epoch_) {
    left_.travelled = left;
    right_.travelled = right;
    epoch_ = epoch;
  }
  ++samples_;
  const double l = advance(left_, left, errors_.left, 0), r = advance(right_, right, errors_.right, 1);
  const double turned = (r - l) / (track_ * (1 + errors_.track)), driven = (l + r) / 2;
  // Chord of the arc: sin(a) / a of half the angle, as a series where that would cancel.
  const double half = turned / 2;
  const double chord = driven * (std::abs(half) < 1e-4 ? 1 - half * half / 6 : std::sin(half) / half);
  x_ += chord * std::cos(yaw_ + half);
  y_ += chord * std::sin(yaw_ + half);
  yaw_ = wrap_angle(yaw_ + turned);
  return {stamp, Transform<Odom, Base>::planar(x_, y_, yaw_)};
}

}  // namespace parhelion::tick
