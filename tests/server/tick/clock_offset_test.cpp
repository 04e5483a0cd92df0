#include "server/tick/clock_offset.hpp"

#include <gtest/gtest.h>

namespace parhelion::tick {
namespace {

ArrivalTime arrival(double s) { return {seconds(s).ns}; }
SensorTime sensor(double s) { return {seconds(s).ns}; }

TEST(ClockOffset, KeepsTheMinimumLatency) {
  ClockOffset clock;
  EXPECT_TRUE(clock.add(arrival(100.010), sensor(0)));
  EXPECT_TRUE(clock.add(arrival(100.105), sensor(0.1)));
  EXPECT_TRUE(clock.add(arrival(100.250), sensor(0.2)));
  // The clocks differ by 100 s and the latencies are 10, 5 and 50 ms: the offset is that of the 5 ms. Slew
  // has raised it by 0.145 s * 1e-4 since.
  EXPECT_NEAR(clock.offset().seconds(), 100.005, 2e-5);
}

TEST(ClockOffset, IsNeverLaterThanTheCurrentMessage) {
  ClockOffset clock;
  for (int i = 0; i < 1000; ++i) {
    const double t = 0.1 * i;
    const double latency = 0.001 * ((i * 7919) % 23);
    ASSERT_TRUE(clock.add(arrival(50 + t + latency), sensor(t)));
    ASSERT_LE(clock.to_server(sensor(t)).ns, arrival(50 + t + latency).ns);
  }
}

TEST(ClockOffset, FollowsADriftingClock) {
  ClockOffset clock;
  for (int i = 0; i <= 10'000; ++i) {
    const double t = 0.1 * i;
    ASSERT_TRUE(clock.add(arrival(t * (1 + 50e-6) + 0.004), sensor(t)));
  }
  EXPECT_NEAR(clock.offset().seconds(), 0.004 + 1000 * 50e-6, 1e-4);
}

TEST(ClockOffset, RejectsASingleStampJumpOfAnHour) {
  ClockOffset clock;
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(clock.add(arrival(0.1 * i + 0.01), sensor(0.1 * i)));
  EXPECT_FALSE(clock.add(arrival(2.0), sensor(3602.0)));
  EXPECT_FALSE(clock.add(arrival(2.1), sensor(-3600.0)));
  EXPECT_TRUE(clock.add(arrival(2.2), sensor(2.19)));
  EXPECT_NEAR(clock.offset().seconds(), 0.01, 1e-3);
}

TEST(ClockOffset, FollowsAnAdjustedClock) {
  ClockOffset clock;
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(clock.add(arrival(0.1 * i + 0.01), sensor(0.1 * i)));
  int refused = 0;
  for (int i = 20; i < 40; ++i) refused += clock.add(arrival(0.1 * i + 0.01), sensor(0.1 * i + 3600)) ? 0 : 1;
  EXPECT_EQ(refused, 4);
  EXPECT_NEAR(clock.offset().seconds(), -3599.99, 1e-3);
}

}  // namespace
}  // namespace parhelion::tick
