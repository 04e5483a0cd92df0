// Robots that are picked up and put down somewhere else while they make a map.
#include <gtest/gtest.h>

#include <algorithm>

#include "fusion/pose/own_slam.hpp"
#include "tests/fusion/pose/kidnapped_drive.hpp"

namespace parhelion::pose {
namespace {

using test::KidnappedDrive;
using test::KidnappedOptions;

constexpr double kSince = 30;  // s, when they are picked up

/// Put down where the drive began, or, `elsewhere`, anywhere in the building.
KidnappedDrive drive_of(std::uint32_t seed, bool elsewhere) {
  const test::RepeatingBuilding building = test::repeating_building(31, {.cupboards = 1, .alike = 0.2});
  KidnappedOptions options;
  options.drive.seed = seed;
  options.since = kSince;
  options.seconds = kSince + 12;
  std::mt19937 random(seed);
  const auto route = test::wandering(building, options.drive.speed * options.seconds, random);
  const auto other = test::wandering(building, options.drive.speed * options.seconds, random);
  const test::TruePath before(route, options.drive.speed),
      after(elsewhere ? other : route, options.drive.speed);
  const test::KidnappedPath path(before, after, kSince, 0);
  KidnappedDrive drive{test::robot_with_laser(), {}, test::kidnapped::odometry(path, options, random), 0};
  for (double t = 0.3; t + 0.1 < options.seconds; t += options.drive.scan_period) {
    const Scan scan = test::kidnapped::scan_at(building.walls, {}, drive.robot, path, t,
                                               options.drive.range_sigma, random, drive.unmapped);
    drive.scans.push_back({scan, path.at(t), {}});
  }
  return drive;
}

struct Outcome {
  bool tracked_before = true;            ///< every scan
  std::optional<double> noticed, found;  ///< s after it was put down; `found`: tracking, at the right place
  bool wrong = false;                    ///< tracking at another place, from 1 s after it was put down
  std::vector<OdometryFinding> findings;
};

Outcome mapped(const KidnappedDrive& drive) {
  const auto slam = make_own_mapper(drive.robot, {});
  Outcome outcome;
  if (!slam) return outcome;
  std::optional<Pose2> T_true_map;
  auto odometry = drive.odometry.begin();
  for (const test::TrueScan& at : drive.scans) {
    for (; odometry != drive.odometry.end() && odometry->stamp <= at.scan.stamp; ++odometry)
      (*slam)->add(*odometry);
    const auto estimate = (*slam)->add(at.scan);
    if (!estimate) continue;
    const Pose2 found = planar(estimate->T_map_base);
    if (!T_true_map) T_true_map = at.T_map_base * found.inverse();
    const double after = (at.scan.stamp - SensorTime{test::TrueDrive::kStart}).seconds() - kSince;
    const bool tracking = estimate->state == SlamState::tracking;
    const bool right = ((*T_true_map * found).position() - at.T_map_base.position()).norm() < 0.3;
    if (after < 0) outcome.tracked_before &= tracking && right;
    if (after >= 0 && !tracking && !outcome.noticed) outcome.noticed = after;
    if (after >= 0 && tracking && right && outcome.noticed && !outcome.found) outcome.found = after;
    outcome.wrong |= after > 1 && tracking && !right;
  }
  outcome.findings = (*slam)->odometry_findings();
  return outcome;
}

TEST(KidnappedMapping, ARobotPutDownInItsMapIsNoticedAndFoundAgain) {
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    const Outcome outcome = mapped(drive_of(seed, false));
    EXPECT_TRUE(outcome.tracked_before) << seed;
    ASSERT_TRUE(outcome.noticed) << seed;
    EXPECT_LT(*outcome.noticed, 1) << seed;
    ASSERT_TRUE(outcome.found) << seed;
    EXPECT_FALSE(outcome.wrong) << seed;
    ASSERT_FALSE(outcome.findings.empty()) << seed;
    EXPECT_EQ(outcome.findings.front().fault, OdometryFault::carried) << seed;
    EXPECT_TRUE(outcome.findings.front().until) << seed << ": it is over when the robot is found";
  }
}

TEST(KidnappedMapping, ARobotPutDownOutsideItsMapIsNotTrackedAtAWrongPlace) {
  for (const std::uint32_t seed : {4U, 5U, 6U}) {
    const Outcome outcome = mapped(drive_of(seed, true));
    EXPECT_TRUE(outcome.tracked_before) << seed;
    ASSERT_TRUE(outcome.noticed) << seed;
    EXPECT_LT(*outcome.noticed, 1) << seed;
    EXPECT_FALSE(outcome.wrong) << seed;
  }
}

}  // namespace
}  // namespace parhelion::pose
