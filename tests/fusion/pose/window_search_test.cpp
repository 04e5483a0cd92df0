// The search around an expected pose, and the map for it, in parts.
#include "fusion/pose/matching/window_search.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "fusion/pose/matching/scan_points.hpp"
#include "tests/fusion/pose/room.hpp"

namespace parhelion::pose {
namespace {

std::vector<Eigen::Vector2d> points_seen_from(const Pose2& pose, std::uint32_t seed) {
  std::mt19937 random(seed);
  const RobotDescription robot = test::robot_with_laser();
  const Scan scan = test::scan_from(test::ring_building(), robot, pose, {}, {}, random);
  return deskewed(scan, *robot.laser, {}).points;
}

std::vector<Eigen::Vector2d> corridor_points() {
  std::vector<Eigen::Vector2d> points;
  for (double x = 1; x < 11; x += 0.5) {
    const Pose2 place{x, 1.3, 0};
    for (const Eigen::Vector2d& p : points_seen_from(place, 5)) points.push_back(place * p);
  }
  return points;
}

const WindowSearch::Request kSeveral{0.3, 8, 0.5, 0.3};

void expect_same(const std::vector<WindowSearch::Candidate>& a,
                 const std::vector<WindowSearch::Candidate>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].score, b[i].score);
    EXPECT_EQ(a[i].T_map_base.x, b[i].T_map_base.x);
    EXPECT_EQ(a[i].T_map_base.y, b[i].T_map_base.y);
    EXPECT_EQ(a[i].T_map_base.yaw, b[i].T_map_base.yaw);
  }
}

TEST(WindowSearch, DoesNotDependOnItsParts) {
  const CorrelativeMap map(corridor_points(), 0.1, 6);
  const Pose2 truth{6, 1.4, 0.1};
  const auto points = thinned(points_seen_from(truth, 7), 60);
  const WindowSearch::Window window{truth * Pose2{0.4, -0.3, 0.05}, 1.5, 1.5, 0.4};
  const auto at_once = map.search(points, window, kSeveral);
  ASSERT_GT(at_once.size(), 1U);
  for (const std::size_t part : {1, 64, 1000}) {
    WindowSearch search(map, points, window, kSeveral);
    int parts = 1;
    while (!search.advance(map, part)) ++parts;
    EXPECT_GT(parts, 1) << part;
    expect_same(search.found(), at_once);
  }
}

TEST(WindowSearch, FindsTheBestPlaceOfAnExhaustiveSearch) {
  const CorrelativeMap map(corridor_points(), 0.1, 6);
  for (const Pose2& truth : {Pose2{4, 1.4, 0.1}, {8, 1.2, -0.2}}) {
    const auto points = thinned(points_seen_from(truth, 7), 60);
    const WindowSearch::Window window{truth * Pose2{-0.3, 0.2, 0.1}, 0.9, 0.9, 0.3};
    WindowSearch search(map, points, window, {});
    ASSERT_TRUE(search.advance(map, std::numeric_limits<std::size_t>::max()));
    const auto slow = map.search_slow(points, window, {});
    ASSERT_FALSE(slow.empty());
    ASSERT_FALSE(search.found().empty());
    EXPECT_EQ(search.found().front().score, slow.front().score);
  }
}

TEST(CorrelativeMap, IsTheSameInTwoParts) {
  const auto points_map = corridor_points();
  const CorrelativeMap whole(points_map, 0.1, 6);
  CorrelativeMap parts = CorrelativeMap::begun(points_map, 0.1, 6);
  EXPECT_TRUE(whole.is_complete());
  EXPECT_FALSE(parts.is_complete());
  parts.complete();
  EXPECT_TRUE(parts.is_complete());
  const auto points = thinned(points_seen_from({6, 1.4, 0.1}, 7), 60);
  const WindowSearch::Window window{{5.8, 1.3, 0}, 1.5, 1.5, 0.4};
  const auto found = whole.search(points, window, kSeveral);
  ASSERT_FALSE(found.empty());
  expect_same(parts.search(points, window, kSeveral), found);
}

}  // namespace
}  // namespace parhelion::pose
