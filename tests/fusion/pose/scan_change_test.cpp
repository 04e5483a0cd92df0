// What has changed between two scans.
#include "fusion/pose/matching/scan_change.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace parhelion::pose {
namespace {

/// Of a round hall of 5 m, from its middle; in front, over `wide` rad, something 1 m away.
ScanPoints hall_with(double wide, double stamp = 0) {
  ScanPoints scan;
  scan.stamp = SensorTime{} + seconds(stamp);
  for (int i = -180; i < 180; ++i) {
    const double angle = i * std::numbers::pi / 180, range = std::abs(angle) < wide / 2 ? 1 : 5;
    scan.points.emplace_back(range * std::cos(angle), range * std::sin(angle));
  }
  return scan;
}

TEST(ScanChange, WhatComesHasAppearedAndWhatGoesHasVanished) {
  const double quarter = std::numbers::pi / 2;
  const ScanChange comes = change_between(hall_with(0), hall_with(quarter), {});
  ASSERT_TRUE(comes.known);
  EXPECT_NEAR(comes.appeared, 0.25, 0.02);
  EXPECT_EQ(comes.vanished, 0) << "the wall behind it is hidden";
  EXPECT_TRUE(comes.exceeds(0.2));
  EXPECT_FALSE(comes.exceeds(0.3));
  const ScanChange goes = change_between(hall_with(quarter), hall_with(0), {});
  EXPECT_NEAR(goes.vanished, 0.25, 0.02);
  EXPECT_EQ(goes.appeared, 0);
}

TEST(ScanChange, NothingIsKnownOfAFewReturns) {
  ScanPoints few = hall_with(0);
  few.points.resize(20);
  EXPECT_FALSE(change_between(few, few, {}).exceeds(0));
}

TEST(PreviousScan, IsComparableWithTheNextButNotAfterAGap) {
  PreviousScan previous;
  EXPECT_EQ(previous.comparable(SensorTime{}), nullptr);
  for (int i = 0; i < 10; ++i) previous.set(hall_with(0, 0.1 * i));
  const SensorTime last = SensorTime{} + seconds(0.9);
  EXPECT_NE(previous.comparable(last + seconds(0.1)), nullptr);
  EXPECT_EQ(previous.comparable(last + seconds(0.3)), nullptr);
  EXPECT_EQ(previous.comparable(last - seconds(0.1)), nullptr);
  previous.forget();
  EXPECT_EQ(previous.comparable(last + seconds(0.1)), nullptr);
}

}  // namespace
}  // namespace parhelion::pose
