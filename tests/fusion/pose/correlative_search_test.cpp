// The search of a whole map: the same result as an exhaustive one, in slices whose work is bounded.
#include "fusion/pose/search/correlative_search.hpp"

#include <gtest/gtest.h>

#include <random>

#include "fusion/pose/search/localizer_search.hpp"
#include "tests/fusion/pose/room.hpp"

namespace parhelion::pose {
namespace {

std::vector<Eigen::Vector2d> seen_from(const Pose2& pose, std::uint32_t seed) {
  std::mt19937 random(seed);
  const RobotDescription robot = test::robot_with_laser();
  const Scan scan = test::scan_from(test::ring_building(), robot, pose, {}, {}, random);
  return deskewed(scan, *robot.laser, {}).points;
}

std::vector<Eigen::Vector2d> ring_points() {
  std::vector<Eigen::Vector2d> points;
  for (const Pose2& place :
       {Pose2{1.5, 1.3, 0}, {6, 1.3, 0.5}, {10.3, 4, 1.6}, {6, 6.7, 3.1}, {1.6, 5, -1.5}}) {
    for (const Eigen::Vector2d& p : seen_from(place, 3)) points.push_back(place * p);
  }
  return points;
}

/// Until it ends; checks the work of each slice.
CorrelativeSearch searched(const CorrelativeMap& map, std::span<const Eigen::Vector2d> points,
                           const CorrelativeSearch::Request& request, std::size_t slice) {
  CorrelativeSearch search;
  search.begin(map, points, request);
  for (bool ended = false; !ended;) {
    const std::size_t before = search.evaluations();
    ended = search.advance(map, slice);
    EXPECT_LE(search.evaluations() - before, slice);
  }
  return search;
}

void expect_same(const CorrelativeSearch& a, const CorrelativeSearch& b) {
  ASSERT_EQ(a.found().size(), b.found().size());
  EXPECT_EQ(a.unlisted(), b.unlisted());
  for (std::size_t i = 0; i < a.found().size(); ++i) {
    EXPECT_EQ(a.found()[i].score, b.found()[i].score);
    EXPECT_EQ(a.found()[i].T_map_base.x, b.found()[i].T_map_base.x);
    EXPECT_EQ(a.found()[i].T_map_base.yaw, b.found()[i].T_map_base.yaw);
  }
}

TEST(CorrelativeSearch, FindsTheBestPlaceOfAnExhaustiveSearchWithLessWork) {
  const std::vector<Eigen::Vector2d> points_map = ring_points();
  // With one level there is nothing to bound: each cell is evaluated at each heading.
  const CorrelativeMap map(points_map, 0.2, 6), flat(points_map, 0.2, 1);
  CorrelativeSearch::Request request;
  request.max_roots = 1U << 20U;
  for (const Pose2& truth : {Pose2{2, 1.4, 0.3}, {9, 1.2, -2.5}, {10.2, 6.6, 2.2}}) {
    const auto points = thinned(seen_from(truth, 7), 60);
    const CorrelativeSearch fast = searched(map, points, request, 1000);
    const CorrelativeSearch slow = searched(flat, points, request, 1000);
    ASSERT_FALSE(fast.found().empty());
    ASSERT_FALSE(slow.found().empty());
    EXPECT_EQ(fast.found().front().score, slow.found().front().score);
    EXPECT_LT(fast.evaluations(), slow.evaluations() / 4);
    const auto is_true = [&](const CorrelativeSearch::Candidate& candidate) {
      return (candidate.T_map_base.position() - truth.position()).norm() < 0.3;
    };
    EXPECT_TRUE(std::any_of(fast.found().begin(), fast.found().end(), is_true));
  }
}

TEST(CorrelativeSearch, DoesNotDependOnItsSlices) {
  const CorrelativeMap map(ring_points(), 0.2, 6);
  const auto points = thinned(seen_from({6, 1.4, 0.3}, 7), 60);
  expect_same(searched(map, points, {}, 64), searched(map, points, {}, 5000));
}

/// 500 m x 500 m, with a short wall every few metres.
std::vector<Eigen::Vector2d> large_site() {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(0, 500), turn(-3, 3);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < 8000; ++i) {
    const Pose2 wall{anywhere(random), anywhere(random), turn(random)};
    for (double x = 0; x < 3; x += 0.1) points.push_back(wall * Eigen::Vector2d(x, 0));
  }
  return points;
}

TEST(CorrelativeSearch, EndsWithinItsLimitsOnALargeSiteAndReportsWhatItHasLeftOut) {
  const std::vector<Eigen::Vector2d> points_map = large_site();
  const CorrelativeMap map(points_map, 0.2, 6);
  std::vector<Eigen::Vector2d> points;  // 40 m around the middle, as a laser may see
  for (const Eigen::Vector2d& p : points_map) {
    if ((p - Eigen::Vector2d(250, 250)).norm() < 40) points.emplace_back(p.x() - 250, p.y() - 250);
  }
  CorrelativeSearch::Request request;
  request.max_evaluations = 300'000;
  request.max_roots = 1000;
  constexpr std::size_t slice = 20'000;
  const CorrelativeSearch search = searched(map, thinned(points, 70), request, slice);
  // Covering the map with squares is not cut off.
  constexpr std::size_t squares = 80 * 80, headings = 530;
  EXPECT_LE(search.evaluations(), squares * headings + request.max_evaluations + slice);
  EXPECT_GT(search.unlisted(), request.min_score);
}

TEST(GlobalSearch, HasBoundedWorkAtEachScan) {
  FrozenMap map;
  const std::vector<Eigen::Vector2d> points_map = large_site();
  map.fine.add(points_map, {});
  map.coarse.add(points_map, {});
  map.likelihood = CorrelativeMap(points_map, 0.1);
  map.rough = CorrelativeMap(points_map, 0.2, 6);
  ScanPoints scan;
  for (const Eigen::Vector2d& p : points_map) {
    if ((p - Eigen::Vector2d(250, 250)).norm() < 30) scan.points.emplace_back(p.x() - 250, p.y() - 250);
  }
  GlobalSearch search;
  std::size_t before = 0, largest = 0;
  for (int i = 0; i < 40; ++i) {
    scan.stamp = SensorTime{1'000'000'000} + seconds(0.1 * i);
    search.add(map, scan, {});
    const std::size_t now = search.evaluations();
    if (now > before) largest = std::max(largest, now - before);
    before = now;
  }
  EXPECT_GT(largest, 0U);
  EXPECT_LE(largest, GlobalSearch::kMaxEvaluations);
  EXPECT_LE(static_cast<double>(largest), 0.1001 * GlobalSearch::kEvaluationsPerSecond);
}

}  // namespace
}  // namespace parhelion::pose
