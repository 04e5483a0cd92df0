// Which commands are new by their senders' clocks.
#include "server/tick/command_clock.hpp"

#include <gtest/gtest.h>

namespace parhelion::tick {
namespace {

constexpr std::int64_t kStart = 1'700'000'000'000'000'000;

class CommandClockTest : public ::testing::Test {
 protected:
  /// `at`, `stamp`: seconds since the start.
  bool is_new(double at, double stamp) {
    return clock_.is_new(ArrivalTime{kStart} + seconds(at), SensorTime{kStart} + seconds(stamp));
  }
  CommandClock clock_;
};

TEST_F(CommandClockTest, CommandsOfAClockThatDiffersByAnHourAreNew) {
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(is_new(0.05 * i + (i % 3) * 0.01, 0.05 * i - 3600)) << i;
}

TEST_F(CommandClockTest, ACommandRepeatedForEverIsNewOnce) {
  for (const double period : {0.005, 0.02, 0.05, 0.2}) {
    CommandClock clock;
    int accepted = 0;
    for (double at = 0; at < 3; at += period)
      accepted += clock.is_new(ArrivalTime{kStart} + seconds(at), SensorTime{kStart}) ? 1 : 0;
    EXPECT_EQ(accepted, 1) << "each " << period << " s";
  }
}

TEST_F(CommandClockTest, CommandsThatWaitedAndComeAtOnceAreNotNew) {
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(is_new(0.05 * i, 0.05 * i));
  int accepted = 0;
  for (int i = 20; i < 60; ++i) accepted += is_new(3, 0.05 * i) ? 1 : 0;  // stamps of 1 to 2.95 s, at 3 s
  EXPECT_LE(accepted, 5) << "those of the last 250 ms";
  EXPECT_TRUE(is_new(3.05, 3.05));
}

TEST_F(CommandClockTest, AnotherSenderWithAnotherClockIsFollowedAfterFiveCommands) {
  for (const double ahead : {-3600.0, -0.5, 0.5, 3600.0}) {
    clock_ = {};
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(is_new(0.05 * i, 0.05 * i));
    int refused = 0;
    for (int i = 20; i < 60; ++i) refused += is_new(0.05 * i, 0.05 * i + ahead) ? 0 : 1;
    EXPECT_EQ(refused, 4) << ahead;
  }
}

TEST_F(CommandClockTest, ASlowerPathOfLessThanAQuarterOfASecondIsNotLate) {
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(is_new(0.05 * i, 0.05 * i));
  EXPECT_TRUE(is_new(1.24, 1.0));
  EXPECT_FALSE(is_new(1.36, 1.1));
}

}  // namespace
}  // namespace parhelion::tick
