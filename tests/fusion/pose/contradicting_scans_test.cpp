// Scans that contradict each other, in a room where floor comes into the laser's view.
#include "fusion/pose/contradicting_scans.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace parhelion::pose {
namespace {

using Finding = ContradictingScans::Finding;

constexpr double kStep = 0.1;  ///< m per scan, along x

/// In a room of 32 m x 8 m, driven along its middle, with a laser of 200 degrees; one scan in 0.1 s.
class RoomDrive {
 public:
  struct View {
    double aside = 4;  ///< m, to the walls at both sides
    double floor = 9;  ///< m, to the floor in front of the robot, nose down
  };
  /// `explained`: by the map, of the scan.
  Finding drive(double explained, const View& view) {
    ++count_;
    const double x = -4 + kStep * count_;
    ScanPoints scan;
    scan.stamp = start_ + seconds(0.1 * count_);
    for (int i = -100; i <= 100; ++i) {
      const double angle = i * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
      const double range = std::min(c > 0 ? std::min(26 - x, view.floor) / c : (6 + x) / -c,
                                    view.aside / std::max(1e-9, std::abs(s)));
      scan.points.emplace_back(range * c, range * s);
    }
    const Pose2 before{x - kStep, 0, 0}, here{x, 0, 0};
    const Finding finding = scans_.add(scan, before, {kStep, 0, 0}, [&] {
      ScanTracking::Followed found;
      found.match.T_map_base = found.expected.T_map_base = here;
      found.match.explained = explained;
      return found;
    });
    if (finding == Finding::none) scans_.learn(explained);
    return finding;
  }

  /// Scans that are lost; the robot stands.
  void skip(int scans) { start_ = start_ + seconds(0.1 * scans); }
  /// An hour back.
  void restart_clock() { start_ = start_ - seconds(3600); }
  bool in_doubt() const { return scans_.in_doubt(start_ + seconds(0.1 * count_)); }

  void drive_level(int scans) {
    for (int i = 0; i < scans; ++i) EXPECT_EQ(drive(0.95, {}), Finding::none);
  }

 private:
  ContradictingScans scans_;
  SensorTime start_{1'700'000'000'000'000'000};
  int count_ = 0;
};

TEST(ContradictingScans, ARoomThatIsDrivenThroughContradictsNothing) {
  RoomDrive drive;
  drive.drive_level(60);
}

/// As the nose goes down, the floor comes nearer from scan to scan.
void tilt(RoomDrive& drive) {
  EXPECT_NE(drive.drive(0.5, {.floor = 3}), Finding::none);
  EXPECT_EQ(drive.drive(0.4, {.floor = 1.8}), Finding::contradicting);
}

TEST(ContradictingScans, FloorInViewContradictsUntilTheMapExplainsAScanAsUsual) {
  RoomDrive drive;
  drive.drive_level(20);
  tilt(drive);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(drive.drive(0.4, {.floor = 1}), Finding::contradicting) << i;
  // For a second more, scans are compared with those of the floor.
  for (int i = 0; i < 12; ++i) drive.drive(0.95, {});
  drive.drive_level(5);
  EXPECT_FALSE(drive.in_doubt());
  tilt(drive);
  EXPECT_TRUE(drive.in_doubt());
}

/// For longer than walls need to be taken for surroundings.
TEST(ContradictingScans, FloorThatMovesAlongIsNeverTakenForSurroundings) {
  RoomDrive drive;
  drive.drive_level(20);
  tilt(drive);
  for (int i = 0; i < 25; ++i) EXPECT_EQ(drive.drive(0.4, {.floor = 1}), Finding::contradicting) << i;
}

TEST(ContradictingScans, AClockThatRestartsEndsIt) {
  RoomDrive drive;
  for (int i = 0; i < 2; ++i) {
    drive.drive_level(8);
    tilt(drive);
    for (int k = 0; k < 12; ++k) drive.drive(0.95, {});
  }
  tilt(drive);
  drive.restart_clock();
  EXPECT_FALSE(drive.in_doubt());
  drive.drive_level(20);
}

/// One lost scan in the middle of it proves nothing.
TEST(ContradictingScans, AGapDoesNotEndIt) {
  RoomDrive drive;
  drive.drive_level(20);
  tilt(drive);
  drive.skip(4);
  EXPECT_EQ(drive.drive(0.4, {.floor = 1}), Finding::contradicting);
}

/// Lest it be odometry that is wrong. But the pose is in doubt.
TEST(ContradictingScans, NothingContradictsForLongerThanTenSeconds) {
  RoomDrive drive;
  drive.drive_level(20);
  tilt(drive);
  for (int i = 0; i < 100; ++i) drive.drive(0.4, {.floor = 1});
  for (int i = 0; i < 20; ++i) EXPECT_EQ(drive.drive(0.4, {.floor = i % 2 ? 1.0 : 3.0}), Finding::none) << i;
  EXPECT_TRUE(drive.in_doubt());
}

TEST(ContradictingScans, WhatStaysIsTakenForSurroundingsAfterTwoSeconds) {
  RoomDrive drive;
  drive.drive_level(20);
  EXPECT_NE(drive.drive(0.5, {.aside = 2.5}), Finding::none);
  EXPECT_EQ(drive.drive(0.5, {.aside = 1.5}), Finding::contradicting);
  int scans = 0;
  Finding finding = Finding::contradicting;
  for (; finding == Finding::contradicting && scans < 30; ++scans) finding = drive.drive(0.5, {.aside = 1.5});
  EXPECT_EQ(finding, Finding::settled);
  EXPECT_NEAR(scans, 19, 2);
  EXPECT_EQ(drive.drive(0.9, {.aside = 1.5}), Finding::none);
}

/// Somebody comes close, say, whom the next scans show too.
TEST(ContradictingScans, OneChangeSinceThePreviousScanAloneIsNoContradiction) {
  RoomDrive drive;
  drive.drive_level(5);
  EXPECT_EQ(drive.drive(0.5, {.aside = 1.5}), Finding::changed);
  EXPECT_EQ(drive.drive(0.5, {.aside = 1.5}), Finding::none);
}

/// From scan to scan little changes.
TEST(ContradictingScans, FloorThatComesSlowlyIsNoticedWithinASecond) {
  RoomDrive drive;
  drive.drive_level(20);
  Finding finding = Finding::none;
  int scans = 0;
  for (; finding == Finding::none && scans < 20; ++scans)
    finding = drive.drive(0.9, {.floor = 3 - 0.25 * scans});
  EXPECT_EQ(finding, Finding::contradicting);
  EXPECT_LE(scans, 10);
}

/// Out of a hall into a corridor, say.
TEST(ContradictingScans, WhatTheMapExplainsIsNoContradiction) {
  RoomDrive drive;
  drive.drive_level(5);
  EXPECT_EQ(drive.drive(0.95, {.aside = 1.5}), Finding::none);
}

}  // namespace
}  // namespace parhelion::pose
