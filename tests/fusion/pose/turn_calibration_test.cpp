// Calibration of inertial sensors whose errors are known.
#include "fusion/pose/calibration/turn_calibration.hpp"

#include <gtest/gtest.h>

#include "tests/fusion/pose/calibration_drive.hpp"

namespace parhelion::pose {
namespace {

/// What is wrong with a generated inertial sensor.
struct ImuErrors {
  double time_offset = -0.03;  ///< s, to add to its stamps
  double scale = 1.01;         ///< true radians per radian of the sensor
  double bias = 0.02;          ///< rad/s
  double noise = 0.01;         ///< rad/s, 1 sigma of a sample
  double jitter = 0.002;       ///< s, of its stamps
  double drift = 0;            ///< rad/s, 1 sigma of what the bias changes by in a second
  double rate = 100;           ///< Hz
  bool rates = true;           ///< false: gives its orientation only
};

ImuDescription tilted_imu() {
  const Eigen::AngleAxisd turn(2.0, Eigen::Vector3d(0.3, -0.5, 1).normalized());
  return {Transform<Base, Imu>(Eigen::Quaterniond(turn), Eigen::Vector3d(0.1, 0.2, 0.3)), 0};
}

std::vector<ImuSample> imu_of(const test::SampledPath& path, const ImuErrors& errors, std::mt19937& random) {
  std::normal_distribution<double> noise;
  std::vector<ImuSample> samples;
  double bias = errors.bias, last = -1;
  const Eigen::Quaterniond R_imu_base = tilted_imu().T_base_imu.quaternion().conjugate();
  for (double t = 0.01; t < path.duration() - 0.01; t += 1 / errors.rate) {
    bias += errors.drift / std::sqrt(errors.rate) * noise(random);
    const double stamp = t - errors.time_offset + errors.jitter * noise(random);
    if (stamp <= last) continue;
    last = stamp;
    ImuSample sample;
    sample.stamp = SensorTime{} + seconds(1000 + stamp);
    const double turning = wrap_angle(path.at(t + 0.005).yaw - path.at(t - 0.005).yaw) / 0.01;
    if (errors.rates) {
      const double rate = turning / errors.scale + bias + errors.noise * noise(random);
      sample.rotation_rate = R_imu_base * Eigen::Vector3d(0, 0, rate);
    } else {
      const Eigen::AngleAxisd heading(path.at(t).yaw + errors.bias * t, Eigen::Vector3d::UnitZ());
      sample.orientation = heading * R_imu_base.conjugate();
    }
    samples.push_back(sample);
  }
  return samples;
}

Result<TurnCalibration> calibrated(const test::SampledPath& path, const ImuErrors& errors,
                                   std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto laser = test::laser_poses_of(path, test::DriveErrors(), random);
  return calibrate_turns(laser, TurnPath(imu_of(path, errors, random), tilted_imu()), {"IMU"});
}

void expect_within(const Measured& found, double truth, const char* what) {
  EXPECT_TRUE(found.shown) << what << ", sigma " << found.sigma;
  EXPECT_LE(std::abs(found.value - truth), 3 * found.sigma)
      << what << ": " << found.value << " +- " << found.sigma << ", true " << truth;
}

void expect_within(const TurnCalibration& found, const ImuErrors& errors) {
  expect_within(found.time_offset, errors.time_offset, "time offset");
  expect_within(found.scale, errors.scale, "scale");
  expect_within(found.bias, errors.bias, "bias");
}

TEST(TurnCalibration, FindsOffsetScaleAndBiasWithinThreeSigma) {
  const test::SampledPath path = test::brisk_path();
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const auto found = calibrated(path, {}, seed);
    ASSERT_TRUE(found.ok()) << found.error().message;
    expect_within(*found, {});
    EXPECT_LT(found->time_offset.sigma, 0.004);
    EXPECT_LT(found->scale.sigma, 0.003);
    EXPECT_LT(found->bias.sigma, 0.001);
    EXPECT_TRUE(found->advice.empty());
  }
}

TEST(TurnCalibration, FindsLargeErrorsOfAPoorSensor) {
  const test::SampledPath path = test::brisk_path();
  ImuErrors errors{0.41, 0.93, -0.15, 0.05, 0.008, 0.001, 25};
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    errors.time_offset = -errors.time_offset;
    const auto found = calibrated(path, errors, seed);
    ASSERT_TRUE(found.ok()) << found.error().message;
    expect_within(found->time_offset, errors.time_offset, "time offset");
    expect_within(found->scale, errors.scale, "scale");
    // The bias wanders by some 9 mrad/s; its mean is what can be found.
    EXPECT_NEAR(found->bias.value, errors.bias, 0.02);
  }
}

TEST(TurnCalibration, UsesTheOrientationOfASensorWithoutRates) {
  ImuErrors errors;
  errors.rates = false;
  errors.scale = 1;
  errors.bias = 0.001;
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const auto found = calibrated(test::brisk_path(), errors, seed);
    ASSERT_TRUE(found.ok()) << found.error().message;
    expect_within(*found, errors);
  }
}

TEST(TurnCalibration, NamesWhatAStraightDriveDoesNotShow) {
  test::SampledPath path;
  Pose2 pose;
  for (int i = 0; i < 8000; ++i) {
    path.poses.push_back(pose);
    path.twists.push_back({0.5, 0, 0});
    pose = pose * moved({0.5, 0, 0}, test::SampledPath::kStep);
  }
  const auto found = calibrated(path, {}, 4);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_FALSE(found->time_offset.shown);
  EXPECT_EQ(found->time_offset.value, 0);
  EXPECT_FALSE(found->scale.shown);
  EXPECT_EQ(found->scale.value, 1);
  EXPECT_TRUE(found->bias.shown);
  EXPECT_NEAR(found->bias.value, ImuErrors().bias, 0.001);
  EXPECT_EQ(found->advice.size(), 2U);
}

TEST(TurnCalibration, RefusesASensorThatTurnsOtherwise) {
  const test::SampledPath path = test::brisk_path();
  std::mt19937 random(1);
  const auto laser = test::laser_poses_of(path, test::DriveErrors(), random);
  const auto samples = imu_of(path, {}, random);
  ImuDescription upside_down = tilted_imu();
  const Eigen::AngleAxisd over(std::numbers::pi, Eigen::Vector3d::UnitX());
  upside_down.T_base_imu = Transform<Base, Imu>(over * upside_down.T_base_imu.quaternion(), {0, 0, 0});
  const auto turned_over = calibrate_turns(laser, TurnPath(samples, upside_down), {"IMU"});
  ASSERT_FALSE(turned_over.ok());
  EXPECT_NE(turned_over.error().message.find("upside down"), std::string::npos)
      << turned_over.error().message;
  test::SampledPath other = path;
  std::reverse(other.poses.begin(), other.poses.end());
  EXPECT_FALSE(calibrate_turns(laser, TurnPath(imu_of(other, {}, random), tilted_imu()), {"IMU"}).ok());
  EXPECT_FALSE(calibrate_turns(laser, TurnPath(std::vector<ImuSample>{}, tilted_imu()), {"IMU"}).ok());
  EXPECT_FALSE(calibrate_turns({}, TurnPath(samples, tilted_imu()), {"IMU"}).ok());
}

TEST(TurnPath, InterpolatesWithinAndNotAcrossGaps) {
  // A parabola, of which a cubic is exact.
  std::vector<Turn> turns;
  const auto at = [](double t) { return SensorTime{} + seconds(10 + t); };
  const auto angle = [](double t) { return 0.3 * t + 0.2 * t * t; };
  for (int i = 0; i < 20; ++i) {
    const double t = 0.1 * i;
    if (i == 10) continue;
    turns.push_back({at(t), at(t + 0.1), angle(t + 0.1) - angle(t)});
  }
  const TurnPath path(turns);
  const auto part = path.between(at(0.23), at(0.71));
  ASSERT_TRUE(part);
  EXPECT_NEAR(*part, angle(0.71) - angle(0.23), 1e-9);
  EXPECT_FALSE(path.between(at(0.5), at(1.5)));
  EXPECT_FALSE(path.between(at(1.03), at(1.06)));
  EXPECT_FALSE(path.between(at(-0.1), at(0.5)));
  EXPECT_FALSE(path.between(at(1.5), at(2.01)));
}

}  // namespace
}  // namespace parhelion::pose
