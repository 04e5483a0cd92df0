// The hazard sensor against closed formulas: its lag and its noise.
#include "server/tick/hazard_sensor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "fusion/scan/lidar_model.hpp"

namespace parhelion::tick {
namespace {

constexpr double kPeriod = 0.1;  // s

HazardSensor ideal() { return {0, 0, 0, 0}; }

/// Readings of `sensor` for `truth` over time.
template <class Truth>
std::vector<double> readings(const HazardSensor& sensor, HazardKind kind, std::uint64_t seed, int count,
                             Truth truth) {
  HazardResponse response;
  std::vector<double> all;
  for (int i = 0; i < count; ++i) {
    HazardReading reading;
    reading.values.push_back({kind, truth(i), ""});
    response.measure(sensor, seed, kPeriod, reading);
    all.push_back(reading.values[0].value);
  }
  return all;
}

/// Mean and standard deviation.
std::pair<double, double> spread(const std::vector<double>& all) {
  double sum = 0, squares = 0;
  for (const double x : all) sum += x;
  const double mean = sum / static_cast<double>(all.size());
  for (const double x : all) squares += (x - mean) * (x - mean);
  return {mean, std::sqrt(squares / static_cast<double>(all.size()))};
}

TEST(HazardSensor, AnIdealSensorReportsTheTrueValue) {
  for (const HazardKind kind : {HazardKind::radiation, HazardKind::gas}) {
    const auto all = readings(ideal(), kind, 1, 50, [](int i) { return 3.0 * i; });
    for (int i = 0; i < 50; ++i) EXPECT_EQ(all[static_cast<std::size_t>(i)], 3.0 * i);
  }
}

TEST(HazardSensor, StepResponseReachesNineTenthsAfterLagTimesLogTen) {
  HazardSensor sensor = ideal();
  sensor.radiation_lag = 1.8;
  sensor.gas_lag = 6.5;
  for (const HazardKind kind : {HazardKind::radiation, HazardKind::gas}) {
    const double lag = kind == HazardKind::gas ? 6.5 : 1.8;
    const auto all = readings(sensor, kind, 1, 400, [](int i) { return i == 0 ? 0.0 : 100.0; });
    for (std::size_t i = 0; i < all.size(); ++i)
      EXPECT_NEAR(all[i], 100 * (1 - std::exp(-(static_cast<double>(i) * kPeriod) / lag)), 1e-9);
    const auto t90 = static_cast<std::size_t>(std::ceil(lag * std::log(10) / kPeriod));
    EXPECT_LT(all[t90 - 1], 90);
    EXPECT_GE(all[t90], 90);
  }
}

TEST(HazardSensor, CountsHaveTheVarianceOfARatemeter) {
  const HazardSensor sensor;
  for (const double dose_rate : {2.0, 50.0, 5000.0}) {
    const auto all = readings(sensor, HazardKind::radiation, 7, 20'000, [&](int) { return dose_rate; });
    const auto [mean, sigma] = spread(all);
    const double expected =
        dose_rate / std::sqrt(2 * sensor.radiation_counts * dose_rate * sensor.radiation_lag);
    EXPECT_NEAR(mean, dose_rate, 0.2 * expected) << dose_rate;
    EXPECT_NEAR(sigma, expected, 0.08 * expected) << dose_rate;
    for (const double each : all) ASSERT_GE(each, 0);
  }
}

TEST(HazardSensor, GasNoiseHasItsSigmaAndIsNeverNegative) {
  HazardSensor sensor;
  sensor.gas_noise = 0.5;
  const auto [mean, sigma] = spread(readings(sensor, HazardKind::gas, 7, 20'000, [](int) { return 40.0; }));
  EXPECT_NEAR(mean, 40, 0.02);
  EXPECT_NEAR(sigma, 0.5, 0.02);
  for (const double each : readings(sensor, HazardKind::gas, 7, 2000, [](int) { return 0.0; }))
    ASSERT_GE(each, 0);
}

TEST(HazardSensor, OnlyTheSameSeedGivesTheSameReadings) {
  const auto run = [](std::uint64_t seed) {
    return readings(HazardSensor(), HazardKind::radiation, seed, 200, [](int i) { return 5.0 + 0.1 * i; });
  };
  const auto once = run(3), again = run(3), other = run(4);
  EXPECT_EQ(std::memcmp(once.data(), again.data(), once.size() * sizeof(double)), 0);
  EXPECT_NE(once, other);
}

TEST(HazardSensor, CountsAreThoseOfAPoissonDistribution) {
  for (const double mean : {0.3, 4.0, 29.0, 31.0, 400.0}) {
    double sum = 0, squares = 0;
    constexpr int draws = 40'000;
    for (int i = 0; i < draws; ++i) {
      const double count = poisson_count(mean, scan::standard_normal({11, 0}, static_cast<std::size_t>(i)));
      ASSERT_EQ(count, std::floor(count));
      sum += count;
      squares += count * count;
    }
    const double found = sum / draws;
    EXPECT_NEAR(found, mean, 4 * std::sqrt(mean / draws));
    EXPECT_NEAR(squares / draws - found * found, mean, 0.04 * mean + 0.1);
  }
  EXPECT_EQ(poisson_count(0, 8), 0);
  EXPECT_EQ(poisson_count(1000, -40), 0);
}

}  // namespace
}  // namespace parhelion::tick
