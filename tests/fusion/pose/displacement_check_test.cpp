// When a robot that makes a map counts as picked up.
#include "fusion/pose/mapping/displacement_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace parhelion::pose {
namespace {

/// m, ranges ahead and behind.
ScanPoints long_hall(double ahead, double behind, double stamp = 0) {
  ScanPoints scan;
  scan.stamp = SensorTime{} + seconds(stamp);
  for (int i = -180; i < 180; ++i) {
    const double angle = i * std::numbers::pi / 180, range = std::abs(i) < 90 ? ahead : behind;
    scan.points.emplace_back(range * std::cos(angle), range * std::sin(angle));
  }
  return scan;
}

/// After scans that the map explains.
DisplacementCheck check_of_a_robot_that_drives() {
  DisplacementCheck check;
  for (int i = 0; i < 5; ++i) check.add(long_hall(3, 6), long_hall(3, 6), {}, 0.9);
  return check;
}

TEST(DisplacementCheck, ARobotThatWasPutDownIsSuspectedAtOnceAndSureWithTheNextScan) {
  DisplacementCheck check = check_of_a_robot_that_drives();
  EXPECT_FALSE(check.is_suspected());
  check.add(long_hall(3, 6), long_hall(6, 3), {}, 0.3);
  EXPECT_TRUE(check.is_suspected());
  EXPECT_FALSE(check.is_displaced());
  check.add(long_hall(3, 6), long_hall(6, 3), {}, 0.3);
  EXPECT_TRUE(check.is_displaced());
  check.forget();
  EXPECT_FALSE(check.is_suspected() || check.is_displaced());
}

TEST(DisplacementCheck, PeopleAroundTheRobotDoNotPickItUp) {
  DisplacementCheck check = check_of_a_robot_that_drives();
  for (int i = 0; i < 5; ++i) check.add(long_hall(3, 6), long_hall(3, 1), {}, 0.4);
  EXPECT_TRUE(check.is_suspected());
  EXPECT_FALSE(check.is_displaced());
}

TEST(DisplacementCheck, WhatIsNewButContradictsNothingIsNoReason) {
  DisplacementCheck check = check_of_a_robot_that_drives();
  for (int i = 0; i < 5; ++i) check.add(long_hall(3, 6), long_hall(3, 6), {}, 0.1);
  EXPECT_FALSE(check.is_suspected());
}

TEST(DisplacementCheck, WhatOdometryExplainsIsNoContradiction) {
  DisplacementCheck check = check_of_a_robot_that_drives();
  const Pose2 turned{0, 0, std::numbers::pi};
  for (int i = 0; i < 5; ++i) check.add(long_hall(3, 6), long_hall(6, 3), {{}, turned}, 0.3);
  EXPECT_FALSE(check.is_suspected());
}

TEST(DisplacementCheck, NothingIsConcludedFromScansThatAreFarApartInTime) {
  DisplacementCheck check = check_of_a_robot_that_drives();
  for (int i = 1; i < 5; ++i) check.add(long_hall(3, 6), long_hall(6, 3, i), {}, 0.3);
  EXPECT_FALSE(check.is_suspected());
}

TEST(DisplacementCheck, AScanThatTheMapExplainsMayDifferMore) {
  DisplacementCheck check = check_of_a_robot_that_drives();
  for (int i = 0; i < 5; ++i) check.add(long_hall(3, 6), long_hall(3, 1), {}, 0.8);
  EXPECT_FALSE(check.is_suspected());
}

}  // namespace
}  // namespace parhelion::pose
