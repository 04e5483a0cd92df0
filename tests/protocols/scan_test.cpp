// Beams of scans: their directions, and evenly spaced copies.
#include "protocols/scan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace parhelion {
namespace {

constexpr double kFullTurn = 2 * std::numbers::pi;

/// A full turn of n beams from `first`, each off its place by at most 0.4 of a step; range i of beam i.
Scan uneven_turn(std::size_t n, double first) {
  Scan scan;
  const double step = kFullTurn / static_cast<double>(n);
  scan.angle_increment = static_cast<float>(step);
  for (std::size_t i = 0; i < n; ++i) {
    const double off = 0.4 * std::sin(static_cast<double>(7 * i)) * (i == 0 ? 0 : 1);
    scan.angles.push_back(
        static_cast<float>(std::remainder(first + (static_cast<double>(i) + off) * step, kFullTurn)));
    scan.ranges.push_back(static_cast<float>(i));
    scan.intensities.push_back(static_cast<float>(2 * i));
  }
  scan.angle_min = scan.angles.front();
  return scan;
}

TEST(Beams, TheNearestToADirectionIsFoundAcrossTheEndsOfATurn) {
  Scan even;
  even.ranges.assign(360, 1);
  even.angle_min = static_cast<float>(-std::numbers::pi);
  even.angle_increment = static_cast<float>(kFullTurn / 360);
  EXPECT_EQ(even.beam_at(0), 180U);
  EXPECT_EQ(even.beam_at(std::numeric_limits<double>::quiet_NaN()), std::nullopt);
  EXPECT_EQ(even.beam_at(3.0 * kFullTurn), 180U);
  EXPECT_EQ(even.beam_at(even.angle(359) + 0.3 * kFullTurn / 360), 359U);
  const Scan uneven = uneven_turn(300, 2.5);
  for (std::size_t i = 0; i < 300; ++i) EXPECT_EQ(uneven.beam_at(uneven.angle(i)), i);
}

TEST(Beams, NoneIsFoundOutsideOfTheFieldOfView) {
  Scan half;
  half.ranges.assign(181, 1);
  half.angle_min = static_cast<float>(-std::numbers::pi / 2);
  half.angle_increment = static_cast<float>(std::numbers::pi / 180);
  EXPECT_EQ(half.beam_at(std::numbers::pi), std::nullopt);
  EXPECT_EQ(half.beam_at(1.6), std::nullopt);
  EXPECT_EQ(half.beam_at(1.58), 180U);
  EXPECT_EQ(Scan{}.beam_at(0), std::nullopt);
}

TEST(EvenlySpaced, EachBeamHasTheValuesOfTheNearestOne) {
  const Scan scan = uneven_turn(300, 2.5);
  const Scan even = evenly_spaced(scan);
  ASSERT_EQ(even.ranges.size(), scan.ranges.size());
  EXPECT_TRUE(even.angles.empty());
  for (std::size_t i = 0; i < even.ranges.size(); ++i) {
    EXPECT_EQ(even.ranges[i], static_cast<float>(i));  // none is off by half a step
    EXPECT_EQ(even.intensities[i], static_cast<float>(2 * i));
  }
}

TEST(EvenlySpaced, GapsWiderThanAStepStayUnknown) {
  Scan scan = uneven_turn(300, 0);
  scan.angles.erase(scan.angles.begin() + 100, scan.angles.begin() + 110);
  scan.ranges.erase(scan.ranges.begin() + 100, scan.ranges.begin() + 110);
  scan.intensities.clear();
  const Scan even = evenly_spaced(scan);
  ASSERT_EQ(even.ranges.size(), 290U);
  EXPECT_EQ(even.ranges[99], 99);
  for (std::size_t i = 102; i < 108; ++i) EXPECT_TRUE(std::isnan(even.ranges[i])) << i;
  EXPECT_EQ(even.ranges[112], 112);
}

TEST(EvenlySpaced, AnEvenScanStaysAsItIs) {
  Scan scan;
  scan.ranges = {1, 2, 3};
  scan.angle_increment = 0.1F;
  EXPECT_EQ(evenly_spaced(scan).ranges, scan.ranges);
}

}  // namespace
}  // namespace parhelion
