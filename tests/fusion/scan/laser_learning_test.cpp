// What is learned of a laser from walls is what it does.
#include "fusion/scan/laser_learning.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "fusion/scan/range_noise.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::scan {
namespace {

LaserDescription true_laser() {
  LaserDescription laser;
  laser.convention.range_min = 0.05F;
  laser.convention.range_max = 40;
  laser.noise_sigma = 0.01;
  laser.range_noise.sigma = {0.006, 0.006, 0.012, 0.02, 0.02, 0.02};
  laser.range_noise.correlation = 0.4;
  laser.range_noise.spread = 0.3;
  laser.quantization = 0.005;
  laser.intensity_codes = {0, 10};
  laser.intensity_fractions = {0.9F, 0.1F};
  return laser;
}

/// A square room of 2 `half` m, from its middle; seen by the second of two passes `moved` m farther away or
/// nearer, in turns of ten scans, as from a robot that drives.
std::vector<Scan> scans_of(const LaserDescription& laser, double half, std::size_t count, double moved = 0) {
  std::vector<Scan> scans;
  for (std::size_t s = 0; s < count; ++s) {
    Scan scan;
    scan.angle_min = static_cast<float>(-std::numbers::pi / 2);
    scan.angle_increment = static_cast<float>(std::numbers::pi / 720);
    for (std::size_t i = 0; i < 721; ++i) {
      const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
      const double cosine = std::max(std::abs(std::cos(angle)), std::abs(std::sin(angle)));
      const double shift = i % 2 == 0 ? 0 : (s % 20 < 10 ? moved : -moved);
      scan.ranges.push_back(
          measure_surface(laser, {5, s}, i, static_cast<float>(half / cosine + shift), 0).range);
      scan.intensities.push_back(sample_intensity(laser, {5, s}, i));
    }
    scans.push_back(std::move(scan));
  }
  return scans;
}

TEST(LaserLearning, FindsStepNoiseByRangeAndCodes) {
  const LaserDescription real = true_laser();
  std::vector<Scan> scans = scans_of(real, 1.8, 40);
  for (Scan& scan : scans_of(real, 7.5, 40)) scans.push_back(std::move(scan));
  LaserDescription preset = real;
  preset.range_noise = {};
  preset.quantization = 0.01;
  preset.intensity_codes.clear();
  preset.intensity_fractions.clear();
  const auto learned = learn_laser(scans, preset);
  ASSERT_TRUE(learned.ok()) << learned.error().message;
  EXPECT_DOUBLE_EQ(learned->quantization, 0.005);
  EXPECT_NEAR(sigma_at(learned->noise, 2), 0.006, 0.0012);
  EXPECT_NEAR(sigma_at(learned->noise, 8), 0.02, 0.004);
  EXPECT_NEAR(learned->noise.correlation, 0.4, 0.12);
  ASSERT_EQ(learned->intensity_codes, (std::vector<float>{0, 10}));
  EXPECT_NEAR(learned->intensity_fractions[1], 0.1, 0.04);
  EXPECT_NEAR(learned->noise.dropout, 0, 0.001);
}

TEST(LaserLearning, CountsABeamThatFailsAtEqualDistancesAsOftenAsItDoes) {
  const LaserDescription real = true_laser();
  std::vector<Scan> scans = scans_of(real, 1.8, 40);
  for (std::size_t s = 20; s < scans.size(); ++s) {
    for (std::size_t i = 0; i < scans[s].ranges.size(); i += 9)
      scans[s].ranges[i] = std::numeric_limits<float>::quiet_NaN();
  }
  const auto learned = learn_laser(scans, real);
  ASSERT_TRUE(learned.ok()) << learned.error().message;
  EXPECT_NEAR(learned->noise.dropout, 0.5 / 9, 0.003);
}

// Otherwise an injected return would have the motion twice: each beam is cast at its own time.
TEST(LaserLearning, SeparatesMotionBetweenInterlacedPassesFromNoise) {
  LaserDescription real = true_laser();
  real.passes = 2;
  real.pass_period = 0.0133;
  std::vector<Scan> scans = scans_of(real, 1.8, 40, 0.015);
  for (Scan& scan : scans_of(real, 7.5, 40, 0.06)) scans.push_back(std::move(scan));
  LaserDescription preset = real;
  preset.range_noise = {};
  const auto learned = learn_laser(scans, preset);
  ASSERT_TRUE(learned.ok()) << learned.error().message;
  EXPECT_NEAR(sigma_at(learned->noise, 2), 0.006, 0.0012);
  EXPECT_NEAR(sigma_at(learned->noise, 8), 0.02, 0.004);
  EXPECT_NEAR(learned->noise.correlation, 0.4, 0.12);
}

TEST(LaserLearning, RefusesScansWithoutWalls) {
  const LaserDescription laser = true_laser();
  EXPECT_FALSE(learn_laser({}, laser).ok());
  Scan empty;
  empty.ranges.assign(361, laser.convention.no_return_sentinel());
  EXPECT_FALSE(learn_laser(std::vector<Scan>(50, empty), laser).ok());
}

TEST(LaserLearning, NoiseDependsOnKeyAndBeamOnly) {
  const LaserDescription laser = true_laser();
  const double noise = sample_noise(laser, {1, 2}, 30, 4, 0.5);
  EXPECT_EQ(noise, sample_noise(laser, {1, 2}, 30, 4, 0.5));
  EXPECT_NE(noise, sample_noise(laser, {1, 2}, 31, 4, 0.5));
  EXPECT_NE(noise, sample_noise(laser, {1, 3}, 30, 4, 0.5));
}

}  // namespace
}  // namespace parhelion::scan
