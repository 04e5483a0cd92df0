// Doses: rates summed over time, and the events of their limits.
#include "server/tick/dose.hpp"

#include <gtest/gtest.h>

namespace parhelion::tick {
namespace {

HazardReading reading(double radiation, double gas) {
  return {{}, {{HazardKind::radiation, radiation, "uSv/h"}, {HazardKind::gas, gas, "ppm"}}};
}

TEST(Dose, IsTheRateTimesTheDuration) {
  DoseMeter meter;
  std::vector<Event> events;
  for (int i = 0; i < 6000; ++i) meter.add(reading(120, 35), 0.1, {}, events);  // ten minutes
  HazardReading shown = reading(0, 0);
  meter.append_to(shown);
  ASSERT_EQ(shown.values.size(), 4U);
  EXPECT_NEAR(shown.values[2].value, 20, 1e-6);
  EXPECT_EQ(shown.values[2].unit, "uSv");
  EXPECT_NEAR(shown.values[3].value, 350, 1e-6);
  EXPECT_EQ(shown.values[3].unit, "ppm min");
  EXPECT_TRUE(events.empty()) << "no limits";
}

TEST(Dose, EachLimitIsReportedOnceWhereItIsReached) {
  DoseMeter meter;
  DoseLimits limits;
  limits.radiation = {10, 15};
  limits.gas.limit = 100;
  std::vector<Event> events;
  int warned = 0, limited = 0;
  for (int i = 1; i <= 6000; ++i) {
    meter.add(reading(120, 0), 0.1, limits, events);
    if (events.size() == 1 && warned == 0) warned = i;
    if (events.size() == 2 && limited == 0) limited = i;
  }
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].kind, EventKind::dose_warning);
  EXPECT_EQ(events[1].kind, EventKind::dose_limit);
  EXPECT_EQ(events[1].object, "radiation");
  EXPECT_EQ(events[1].text, "uSv");
  EXPECT_NEAR(events[1].value, 15, 0.01);
  EXPECT_NEAR(warned, 3000, 1);  // 10 uSv at 120 uSv/h: 300 s
  EXPECT_NEAR(limited, 4500, 1);
}

TEST(Dose, OnlyKindsOfTheScenarioAreShown) {
  DoseMeter meter;
  HazardReading gas{{}, {{HazardKind::gas, 2, "ppm"}}};
  std::vector<Event> events;
  meter.add(gas, 60, {}, events);
  meter.append_to(gas);
  ASSERT_EQ(gas.values.size(), 2U);
  EXPECT_NEAR(gas.values[1].value, 2, 1e-9);
}

}  // namespace
}  // namespace parhelion::tick
