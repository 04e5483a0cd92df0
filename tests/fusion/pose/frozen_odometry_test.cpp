// Odometry that stops while the robot drives on along a corridor.
#include "fusion/pose/odometry/frozen_odometry.hpp"

#include <gtest/gtest.h>

namespace parhelion::pose {
namespace {

const FrozenOdometry::Motion kDriving{{10, 2, 0.3}, {0.06, 0, 0}, 0.1};

/// `turn`: rad, of the scans since the first, as a function of their number. The scan that showed it, or -1.
template <class Turn>
int first_shown(FrozenOdometry& odometry, int scans, const Turn& turn) {
  int shown = -1;
  for (int i = 1; i <= scans; ++i) {
    odometry.add({}, kDriving, 1);
    if (odometry.add_match(kDriving.T_map_base.yaw + turn(i))) {
      EXPECT_EQ(shown, -1) << "only the first";
      shown = i;
    }
  }
  return shown;
}

TEST(FrozenOdometry, IsShownByATurnAndTheRobotMayHaveDrivenOn) {
  FrozenOdometry odometry;
  EXPECT_EQ(first_shown(odometry, 8, [](int i) { return -0.004 * i; }), 8);
  EXPECT_TRUE(odometry.is_frozen());
  const Pose2 expected = kDriving.T_map_base * Pose2{8 * 0.06, 0, 0}, found = odometry.driven_on();
  EXPECT_NEAR(found.x, expected.x, 1e-9);
  EXPECT_NEAR(found.y, expected.y, 1e-9);
  EXPECT_GT(odometry.sigma(), 0.1);
  // One turn may be an error of a match.
  for (int i = 0; i < 20; ++i) EXPECT_EQ(first_shown(odometry, 1, [](int) { return -0.032; }), -1);
  EXPECT_FALSE(odometry.is_certain());
  EXPECT_EQ(first_shown(odometry, 1, [](int) { return -0.065; }), -1);
  EXPECT_TRUE(odometry.is_certain());
  odometry.add({0.001, 0, 0}, kDriving, 1);
  EXPECT_FALSE(odometry.is_frozen()) << "it moves";
}

TEST(FrozenOdometry, ARobotThatStandsOrBrakesIsNot) {
  FrozenOdometry stands, brakes;
  EXPECT_EQ(first_shown(stands, 200, [](int i) { return 0.004 * (i % 3 - 1); }), -1);
  EXPECT_EQ(first_shown(brakes, 30, [](int i) { return i < 3 ? 0.03 : 0.04; }), -1);
}

TEST(FrozenOdometry, ARobotThatTurnsAfterItStoodIsNotThoughOdometryIsLate) {
  FrozenOdometry late, by_hand;
  EXPECT_EQ(first_shown(late, 15, [](int i) { return i < 10 ? 0 : 0.1 * (i - 9); }), -1);
  EXPECT_EQ(first_shown(by_hand, 100, [](int i) { return i < 35 ? 0 : 0.01 * (i - 35); }), -1);
}

}  // namespace
}  // namespace parhelion::pose
