// Wheel odometry and the inertial sensor of simulated robots against geometry.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/tick/imu_model.hpp"
#include "server/tick/wheel_odometry.hpp"

namespace parhelion::tick {
namespace {

constexpr double kTrack = 0.4;

SensorTime at(int sample) { return SensorTime::from_utime(1'700'000'000'000'000 + sample * 10'000); }

/// Both sides roll evenly in `samples` steps.
Odometry roll(WheelOdometry& wheels, double left, double right, int samples) {
  Odometry last = wheels.add(at(0), 0, 0, 0);
  for (int i = 1; i <= samples; ++i) last = wheels.add(at(i), left * i / samples, right * i / samples, 0);
  return last;
}

double yaw_of(const Odometry& odometry) {
  const Eigen::Matrix3d R = odometry.T_odom_base.rotation();
  return std::atan2(R(1, 0), R(0, 0));
}

TEST(WheelOdometry, IdealWheelsCoverTwoPiRPerTurn) {
  WheelOdometry wheels(kTrack, {}, 1);
  const double driven = 10 * 2 * std::numbers::pi * 0.0975;
  const Odometry end = roll(wheels, driven, driven, 500);
  EXPECT_NEAR(end.T_odom_base.translation().x(), driven, 1e-9);
  EXPECT_NEAR(end.T_odom_base.translation().y(), 0, 1e-9);
}

TEST(WheelOdometry, ACircleClosesForAnyTimeStep) {
  for (const int samples : {7, 50, 1000}) {
    WheelOdometry wheels(kTrack, {}, 1);
    const double radius = 1;
    const double left = 2 * std::numbers::pi * (radius - kTrack / 2),
                 right = 2 * std::numbers::pi * (radius + kTrack / 2);
    const Odometry end = roll(wheels, left, right, samples);
    EXPECT_NEAR(end.T_odom_base.translation().head<2>().norm(), 0, 1e-9)
        << "exact arcs, " << samples << " of them";
    EXPECT_NEAR(yaw_of(end), 0, 1e-9);
  }
}

TEST(WheelOdometry, DriftOverManySeedsMatchesTheDescription) {
  const double translation = 0.03, rotation = 0.05, driven = 10;
  const int seeds = 400;
  double along = 0, turned = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto key = static_cast<std::uint64_t>(seed);
    const WheelOdometryErrors errors = draw_wheel_errors(key, translation, rotation, kTrack);
    WheelOdometry straight(kTrack, errors, key), spin(kTrack, errors, key);
    along +=
        std::pow(roll(straight, driven, driven, 100).T_odom_base.translation().head<2>().norm() - driven, 2);
    // A quarter turn on the spot.
    const double arc = std::numbers::pi / 2 * kTrack / 2;
    turned += std::pow(yaw_of(roll(spin, -arc, arc, 100)) - std::numbers::pi / 2, 2);
  }
  // The systematic part is 1 / sqrt(2) of it; the description is an upper bound.
  const double sigma_along = std::sqrt(along / seeds), sigma_turned = std::sqrt(turned / seeds);
  EXPECT_GT(sigma_along, 0.4 * translation * driven);
  EXPECT_LT(sigma_along, 1.2 * translation * driven);
  EXPECT_GT(sigma_turned, 0.4 * rotation * std::numbers::pi / 2);
  EXPECT_LT(sigma_turned, 1.2 * rotation * std::numbers::pi / 2);
}

TEST(WheelOdometry, OnlyTheSameSeedGivesTheSameWheelErrors) {
  const auto end = [](std::uint64_t seed) {
    WheelOdometry wheels(kTrack, draw_wheel_errors(seed, 0.03, 0.05, kTrack), seed);
    return roll(wheels, 5, 5.2, 200).T_odom_base.translation().eval();
  };
  EXPECT_EQ(end(1), end(1));
  EXPECT_NE(end(1), end(2));
}

TEST(WheelOdometry, SlipCausesOdometryError) {
  // One side slips on the spot: the robot did not turn, but its odometry did.
  WheelOdometry wheels(kTrack, {}, 1);
  EXPECT_NEAR(yaw_of(roll(wheels, 0, 0.2, 20)), 0.2 / kTrack, 1e-9);
}

TEST(WheelOdometry, NoiseDoesNotMoveOdometryAtStandstill) {
  const WheelOdometryErrors errors = draw_wheel_errors(3, 0.05, 0.05, kTrack);
  WheelOdometry wheels(kTrack, errors, 3);
  const auto before = roll(wheels, 1, 1, 50).T_odom_base.translation().eval();
  Odometry after;
  for (int i = 51; i < 1000; ++i) after = wheels.add(at(i), 1, 1, 0);
  EXPECT_EQ(after.T_odom_base.translation(), before);
}

TEST(WheelOdometry, OdometryContinuesAfterATeleport) {
  WheelOdometry wheels(kTrack, {}, 1);
  roll(wheels, 2, 2, 10);
  const Odometry moved = wheels.add(at(11), 0, 0, 1);
  EXPECT_NEAR(moved.T_odom_base.translation().x(), 2, 1e-9);
  EXPECT_NEAR(wheels.add(at(12), 0.1, 0.1, 1).T_odom_base.translation().x(), 2.1, 1e-9);
}

ImuDescription mounted(double x = 0, double yaw = 0) {
  return {Transform<Base, Imu>::planar(x, 0, yaw, 0.2)};
}

const ImuErrors kNoErrors{0, 0, 0, 0, 0, 0, 0, 0};

TEST(ImuModel, AtRestItMeasuresGravityUpwardsAtAnyTilt) {
  ImuModel imu(mounted(), kNoErrors, 1);
  BaseMotion rest;
  ImuSample sample = imu.add(at(0), rest, false);
  EXPECT_NEAR((sample.acceleration - Eigen::Vector3d(0, 0, 9.81)).norm(), 0, 1e-12);
  EXPECT_EQ(sample.rotation_rate, Eigen::Vector3d::Zero());
  const double pitch = 0.3;  // nose down
  rest.T_map_base = Transform<Map, Base>(
      Eigen::Quaterniond(Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY())), Eigen::Vector3d::Zero());
  sample = imu.add(at(1), rest, true);
  EXPECT_NEAR(sample.acceleration.x(), -9.81 * std::sin(pitch), 1e-9);
  EXPECT_NEAR(sample.acceleration.z(), 9.81 * std::cos(pitch), 1e-9);
  ASSERT_TRUE(sample.orientation);
  EXPECT_NEAR(sample.orientation->angularDistance(Eigen::Quaterniond(rest.T_map_base.rotation())), 0, 1e-9);
}

TEST(ImuModel, ALeverArmMeasuresCentripetalAcceleration) {
  const double arm = 0.5, rate = 2;
  ImuModel imu(mounted(arm), kNoErrors, 1);
  BaseMotion turning;
  turning.rotation_rate = {0, 0, rate};
  imu.add(at(0), turning, false);
  const ImuSample sample = imu.add(at(1), turning, false);
  EXPECT_NEAR(sample.acceleration.x(), -rate * rate * arm, 1e-9) << "towards the axis";
  EXPECT_NEAR(sample.rotation_rate.z(), rate, 1e-12);
}

TEST(ImuModel, AccelerationIsMeasuredAlongTheSensorAxes) {
  ImuModel imu(mounted(0, std::numbers::pi / 2), kNoErrors, 1);
  BaseMotion motion;
  imu.add(at(0), motion, false);
  motion.velocity = {0.01, 0, 0};  // in 10 ms: 1 m/s^2
  const ImuSample sample = imu.add(at(1), motion, false);
  EXPECT_NEAR(sample.acceleration.y(), -1, 1e-6) << "the sensor's y axis points along -x of the base";
}

TEST(ImuModel, ATeleportIsNotMeasured) {
  ImuModel imu(mounted(), kNoErrors, 1);
  BaseMotion motion;
  motion.velocity = {1, 0, 0};
  imu.add(at(0), motion, false);
  motion.velocity.setZero();
  EXPECT_NEAR((imu.add(at(1), motion, true).acceleration - Eigen::Vector3d(0, 0, 9.81)).norm(), 0, 1e-12);
}

TEST(ImuModel, NoiseHasItsSpecifiedSizeAndBiasStaysSeparate) {
  ImuErrors errors;
  errors.rate_walk = errors.acceleration_walk = 0;
  ImuModel imu(mounted(), errors, 5), same(mounted(), errors, 5);
  const int samples = 5000;
  double sum = 0, squares = 0;
  for (int i = 0; i < samples; ++i) {
    const double rate = imu.add(at(i), {}, false).rotation_rate.x();
    EXPECT_EQ(same.add(at(i), {}, false).rotation_rate.x(), rate);
    sum += rate;
    squares += rate * rate;
  }
  const double mean = sum / samples;
  EXPECT_LT(std::abs(mean), 5 * errors.rate_bias);
  EXPECT_NEAR(std::sqrt(squares / samples - mean * mean), errors.rate_noise, 0.05 * errors.rate_noise);
}

}  // namespace
}  // namespace parhelion::tick
