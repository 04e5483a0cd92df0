#include "fusion/pose/mapping/loop_comparison.hpp"

#include <gtest/gtest.h>

#include "tests/fusion/pose/corridors.hpp"

namespace parhelion::pose {
namespace {

/// Two drives along the same corridor of 60 m, as keyframes; the second one is displaced in the map.
struct TwoVisits {
  std::vector<Keyframe> keyframes;
  std::vector<Pose2> poses;
  std::vector<std::size_t> again;  ///< each 0.8 m, of the second visit

  /// `shift`: m, where the second visit begins, from 26 m.
  TwoVisits(const test::CorridorOptions& options, const Pose2& displaced, double shift = 0) {
    const test::TrueBuilding building = test::corridor_building(options);
    RobotDescription robot = test::robot_with_laser();
    robot.laser->beam_interval = 0;
    std::mt19937 random(options.seed);
    double driven = 0;
    const auto visit = [&](double from, double to, const Pose2& error) {
      for (double x = from; x < to; x += 0.2, driven += 0.2) {
        const test::TruePath path({{x, 0.1}, {x + 1, 0.1}}, 0.5);
        const Scan scan = test::true_scan(building.now, {}, robot, path, 0, 0.015, random);
        Keyframe keyframe;
        keyframe.scan = deskewed(scan, *robot.laser, {});
        keyframe.T_map_base = error * path.at(0);
        keyframe.driven = driven;
        keyframes.push_back(keyframe);
        poses.push_back(keyframe.T_map_base);
      }
    };
    visit(15, 45, {});
    driven += 100;
    const std::size_t second = keyframes.size();
    visit(26 + shift, 31 + shift, displaced);
    for (std::size_t k = second; k < keyframes.size(); k += 4) again.push_back(k);
  }

  /// Compared with what the first visit saw around x = 28 m.
  std::vector<Closure> closures(double window) const {
    const LoopClosingOptions options;
    const LoopSearch search(keyframes, poses, options);
    Submap submap = search.submap(50, 75);
    LoopComparison comparison(0, again, window);
    int parts = 1;
    while (!comparison.step(search, submap)) ++parts;
    if (again.size() > 2) {
      EXPECT_GT(parts, 20) << "each is a part of what was one of at most 17";
    }
    return comparison.closures();
  }
};

test::CorridorOptions repeating() {
  test::CorridorOptions options;
  options.alike = true;
  options.shut = 1;
  options.clutter = 0;
  return options;
}

TEST(LoopComparison, FindsThePlaceAmongManyDoors) {
  const Pose2 displaced{1.4, 0.3, 0.01};
  const TwoVisits visits({.seed = 5}, displaced);
  const auto closures = visits.closures(4);
  ASSERT_GE(closures.size(), 5U);
  for (const Closure& closure : closures) {
    const Pose2 off = displaced * closure.correction;
    EXPECT_LT((off * closure.place - closure.place).norm(), 0.1);
  }
}

TEST(LoopComparison, DoesNotChooseAmongDoorsThatAreAlike) {
  for (const double along : {2.0, -1.9, 1.0}) {
    const TwoVisits visits(repeating(), {along, 0.1, 0});
    EXPECT_TRUE(visits.closures(4).empty()) << along;
  }
}

TEST(LoopComparison, StaysWhereItIsExpectedIfDoorsAreAlike) {
  const Pose2 displaced{0.1, 0.1, 0.005};
  const TwoVisits visits(repeating(), displaced);
  const auto closures = visits.closures(1.2);
  ASSERT_GE(closures.size(), 5U);
  for (const Closure& closure : closures)
    EXPECT_LT((displaced * closure.correction * closure.place - closure.place).norm(), 0.1);
}

/// The map has seen the next doors better than those where the robot is: they explain all, the right ones
/// nearly all.
TEST(LoopComparison, DoorsThatAreSeenBetterDoNotDrawTheRobotAway) {
  const Pose2 displaced{0.2, 0.1, 0.005};
  for (const double shift : {10.0, 11.0, 13.0}) {
    const TwoVisits visits(repeating(), displaced, shift);
    for (const Closure& closure : visits.closures(5))
      EXPECT_LT((displaced * closure.correction * closure.place - closure.place).norm(), 0.1) << shift;
  }
}

/// Neither do they where the robot is a metre away from the expected place: the right doors are much nearer
/// to that than the wrong ones, 4 m on.
TEST(LoopComparison, DoorsThatAreSeenBetterDoNotDrawTheRobotPastNearerOnes) {
  for (const double along : {-1.0, 1.5}) {
    const Pose2 displaced{along, 0.1, 0.005};
    for (const double shift : {9.0, 11.0, 13.0}) {
      const TwoVisits visits(repeating(), displaced, shift);
      for (const Closure& closure : visits.closures(5)) {
        EXPECT_LT((displaced * closure.correction * closure.place - closure.place).norm(), 0.1)
            << along << " " << shift;
      }
    }
  }
}

TEST(LoopSearch, AddsTheSurroundingsOfASubmapInPartsOfThousandsOfPoints) {
  const TwoVisits visits({.seed = 5}, {});
  const LoopClosingOptions options;
  const LoopSearch search(visits.keyframes, visits.poses, options);
  Submap submap = search.submap(50, 75);
  std::size_t next = 0;
  int parts = 0;
  do {
    search.add_surroundings(submap);
    std::size_t points = 0;
    for (std::size_t k = parts == 0 ? submap.surroundings->begin : next; k < submap.surroundings->next; ++k)
      points += visits.keyframes[k].scan.points.size();
    EXPECT_LE(points, 7000U);
    next = submap.surroundings->next;
    ++parts;
  } while (!submap.surroundings->is_complete());
  EXPECT_GE(parts, 3);
  for (std::size_t k = 50; k < 75; ++k) {
    const Pose2 T_anchor_base = visits.poses[submap.anchor].inverse() * visits.poses[k];
    EXPECT_TRUE(submap.surroundings->seen.is_inside(T_anchor_base.position())) << k;
  }
}

TEST(LoopComparison, FindsNothingInAnotherCorridor) {
  TwoVisits visits({.seed = 5}, {});
  const TwoVisits others({.seed = 6}, {});
  for (std::size_t k : visits.again) visits.keyframes[k].scan = others.keyframes[k].scan;
  EXPECT_TRUE(visits.closures(4).empty());
}

TEST(LoopComparison, ScansAtTheEndOfWhatTheMapHasSeenFitAtTheirPlaceAlone) {
  test::CorridorOptions options{.seed = 5};
  options.shut = 0.3;
  const Pose2 displaced{0.3, -0.1, 0};
  const TwoVisits visits(options, displaced, 7);
  for (const Closure& closure : visits.closures(4))
    EXPECT_LT((displaced * closure.correction * closure.place - closure.place).norm(), 0.1);
}

TEST(LoopComparison, TwoScansAreNotEnough) {
  TwoVisits visits({.seed = 5}, {});
  for (const std::size_t scans : {2, 0}) {
    visits.again.resize(scans);
    EXPECT_TRUE(visits.closures(4).empty()) << scans;
  }
}

}  // namespace
}  // namespace parhelion::pose
