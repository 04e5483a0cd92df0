// People who walk along with a robot are no evidence of where it is.
#include "fusion/pose/mapping/companions.hpp"

#include <gtest/gtest.h>

#include "tests/fusion/pose/corridors.hpp"

namespace parhelion::pose {
namespace {

/// A robot that drives along a corridor at 0.8 m/s, and what its laser sees once a second.
struct CorridorWalk {
  std::vector<test::Segment> walls;
  std::vector<test::Walker> walkers;
  RobotDescription robot = test::robot_with_laser();
  test::TruePath path{{{5, 0}, {50, 0}}, 0.8};
  std::mt19937 random{7};

  CorridorWalk() { robot.laser->beam_interval = robot.laser->pass_period = 0; }
  ScanPoints scan_at(double t) {
    return deskewed(test::true_scan(walls, walkers, robot, path, t, 0.01, random), *robot.laser, {});
  }
  Pose2 step(double from, double to) const { return path.at(from).inverse() * path.at(to); }
  /// How many points lie on the walkers' legs.
  std::size_t on_walkers(const ScanPoints& scan, double t) const {
    return static_cast<std::size_t>(
        std::count_if(scan.points.begin(), scan.points.end(), [&](const Eigen::Vector2d& p) {
          const Pose2 base = path.at(t);
          return std::any_of(walkers.begin(), walkers.end(), [&](const test::Walker& walker) {
            return (base * p - walker.at(base.position(), t)).norm() < 0.35;
          });
        }));
  }
};

std::vector<test::Segment> plain_corridor() { return {{{-5, -1.1}, {90, -1.1}}, {{-5, 1.1}, {90, 1.1}}}; }

struct PointCounts {
  std::size_t people = 0, people_kept = 0, others = 0, others_kept = 0;
};

PointCounts counts_of(CorridorWalk& walk) {
  Companions companions;
  companions.without(walk.scan_at(5), {});
  PointCounts counts;
  for (double t = 6; t < 40; ++t) {
    const ScanPoints whole = walk.scan_at(t), kept = companions.without(whole, walk.step(t - 1, t));
    const std::size_t people = walk.on_walkers(whole, t), people_kept = walk.on_walkers(kept, t);
    counts.people += people;
    counts.people_kept += people_kept;
    counts.others += whole.points.size() - people;
    counts.others_kept += kept.points.size() - people_kept;
  }
  return counts;
}

TEST(Companions, PeopleWhoWalkAlongAreLeftOut) {
  CorridorWalk walk;
  walk.walls = plain_corridor();
  walk.walkers = {{0.9, 0.1, 0}, {1.4, -0.3, 0.02}};
  const PointCounts counts = counts_of(walk);
  EXPECT_GT(counts.people, 300U);
  EXPECT_LT(counts.people_kept, counts.people / 5);  // one hides the other at times
  EXPECT_EQ(counts.others_kept, counts.others);
}

TEST(Companions, SomebodyInFrontOfADarkEndOfTheCorridorIsLeftOut) {
  CorridorWalk walk;
  walk.walls = plain_corridor();
  walk.robot.laser->convention.range_max = 8;
  walk.walkers = {{1.5, 0, 0}};
  const PointCounts counts = counts_of(walk);
  EXPECT_GT(counts.people, 100U);
  EXPECT_LT(counts.people_kept, counts.people / 10);
}

TEST(Companions, PostsThatStandAsFarApartAsTheRobotDrivesAreKept) {
  CorridorWalk walk;
  walk.walls = plain_corridor();
  for (int i = 0; i < 60; ++i) test::add_turned_box(walk.walls, {0.8 * i, 0.7}, {0.12, 0.12}, 0.3);
  const PointCounts counts = counts_of(walk);
  EXPECT_EQ(counts.others_kept, counts.others);
}

TEST(Companions, SomebodyBesideARobotThatStopsIsSeenAgain) {
  CorridorWalk walk;
  walk.walls = plain_corridor();
  walk.walkers = {{0.9, 0.1, 0}};
  Companions companions;
  for (double t = 5; t < 10; ++t) companions.without(walk.scan_at(t), walk.step(t - 1, t));
  ScanPoints last = walk.scan_at(9);
  for (int i = 1; i <= 5; ++i) {
    last.stamp = last.stamp + seconds(1.0);
    const std::size_t kept = companions.without(last, {}).points.size();
    if (i > 3) {
      EXPECT_EQ(kept, last.points.size());
    }
  }
}

TEST(Companions, WhereMostOfAScanComesAlongOdometryIsWrong) {
  CorridorWalk walk;
  test::add_turned_box(walk.walls, {5, 0}, {12, 12}, 0);
  for (int i = 0; i < 12; ++i) {
    const double angle = -1.5 + 0.27 * i;
    test::add_turned_box(walk.walls, {5 + 2 * std::cos(angle), 2 * std::sin(angle)}, {0.2, 0.4}, angle);
  }
  Companions companions;
  for (int i = 0; i < 5; ++i) {
    ScanPoints scan = walk.scan_at(0);
    scan.stamp = scan.stamp + seconds(1.0 * i);
    EXPECT_EQ(companions.without(scan, {0.8, 0, 0}).points.size(), scan.points.size());
  }
}

TEST(Companions, StampsThatJumpBackAndOdometryThatIsNoNumberAreForgotten) {
  CorridorWalk walk;
  walk.walls = plain_corridor();
  walk.walkers = {{0.9, 0.1, 0}};
  Companions companions;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (double t = 5; t < 8; ++t) companions.without(walk.scan_at(t), walk.step(t - 1, t));
  const ScanPoints past = walk.scan_at(1);
  EXPECT_EQ(companions.without(past, walk.step(7, 8)).points.size(), past.points.size());
  const ScanPoints now = walk.scan_at(8);
  EXPECT_EQ(companions.without(now, {nan, 0, 0}).points.size(), now.points.size());
  companions.without(walk.scan_at(9), walk.step(8, 9));
  const ScanPoints next = walk.scan_at(10);
  EXPECT_LT(companions.without(next, walk.step(9, 10)).points.size(), next.points.size());
}

TEST(Companions, OfABuildingWithoutPeopleNextToNothingIsLeftOut) {
  std::size_t all = 0, kept = 0;
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    CorridorWalk walk;
    walk.walls = test::corridor_building({.seed = seed, .clutter = 0.3}).now;
    const PointCounts counts = counts_of(walk);
    all += counts.others;
    kept += counts.others_kept;
  }
  EXPECT_GT(all, 20'000U);
  EXPECT_GT(kept, all - all / 1000);
}

}  // namespace
}  // namespace parhelion::pose
