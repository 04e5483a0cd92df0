#include "server/station/sensor_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace parhelion::station {
namespace {

/// The state of a sensor with these stamps, s.
SensorState state_of(const std::vector<double>& stamps) {
  SensorWatch watch;
  watch.watch("IMU", SensorWatch::Clock::server);
  for (const double t : stamps)
    watch.record("IMU", SensorTime{} + seconds(100 + t), ArrivalTime{} + seconds(100 + t));
  return watch.states(ArrivalTime{} + seconds(100 + stamps.back())).at(0);
}

TEST(SensorWatch, CountsMissingStampsAsLost) {
  std::vector<double> stamps;
  for (int i = 0; i < 60; ++i) {
    if (i % 60 != 30) stamps.push_back(0.05 * i);
  }
  const SensorState state = state_of(stamps);
  EXPECT_NEAR(state.loss, 1.0 / 59, 1e-3);
  EXPECT_NEAR(state.rate, 20, 0.5);
}

TEST(SensorWatch, AFixedRateSampledByAFasterClockHasNoLoss) {
  for (const double beats : {60.0, 120.0, 150.0, 1000.0}) {
    std::vector<double> stamps;
    for (int i = 0; i < 200; ++i) stamps.push_back(std::ceil(0.02 * i * beats - 1e-9) / beats);
    EXPECT_LT(state_of(stamps).loss, 0.01) << "50 Hz at " << beats << " Hz";
  }
}

TEST(SensorWatch, RandomLossIsNotTakenForARegularGap) {
  for (const double fraction : {0.1, 0.2, 0.4}) {
    double mean_loss = 0;
    constexpr int runs = 40;
    for (unsigned seed = 0; seed < runs; ++seed) {
      std::mt19937 random(seed);
      std::vector<double> stamps;
      for (int i = 0; i < 400; ++i) {
        if (std::uniform_real_distribution<>()(random) >= fraction) stamps.push_back(0.01 * i);
      }
      mean_loss += state_of(stamps).loss / runs;
    }
    EXPECT_NEAR(mean_loss, fraction, 0.02 + fraction / 10);
  }
}

TEST(SensorWatch, ASilentSensorIsLateThenLost) {
  SensorWatch watch;
  watch.watch("SCAN", SensorWatch::Clock::server);
  const auto status = [&](double t) { return watch.states(ArrivalTime{} + seconds(t)).at(0).status; };
  EXPECT_EQ(status(100), SensorState::Health::none);
  for (int i = 0; i <= 20; ++i)
    watch.record("SCAN", SensorTime{} + seconds(100 + 0.05 * i), ArrivalTime{} + seconds(100 + 0.05 * i));
  EXPECT_EQ(status(101.1), SensorState::Health::ok);
  EXPECT_EQ(status(101.3), SensorState::Health::late);
  EXPECT_EQ(status(102.1), SensorState::Health::lost);
}

TEST(SensorWatch, TheSilenceOfALostSensorIsKnown) {
  SensorWatch watch;
  watch.watch("POSE_COV", SensorWatch::Clock::server);
  const auto silence = [&](double t) { return watch.silence_of("POSE_COV", ArrivalTime{} + seconds(t)); };
  EXPECT_FALSE(silence(100)) << "nothing came yet";
  for (int i = 0; i <= 20; ++i)
    watch.record("POSE_COV", SensorTime{} + seconds(100 + 0.1 * i), ArrivalTime{} + seconds(100 + 0.1 * i));
  EXPECT_FALSE(silence(102.1));
  ASSERT_TRUE(silence(109.6));
  EXPECT_NEAR(*silence(109.6), 7.6, 1e-6);
  EXPECT_FALSE(watch.silence_of("SCAN", ArrivalTime{} + seconds(109.6)));
}

}  // namespace
}  // namespace parhelion::station
