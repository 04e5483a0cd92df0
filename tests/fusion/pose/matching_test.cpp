// The parts of SLAM against their reference implementations, and on a known building.
#include <gtest/gtest.h>

#include "fusion/pose/mapping/pose_graph.hpp"
#include "fusion/pose/matching/correlative.hpp"
#include "fusion/pose/matching/scan_match.hpp"
#include "fusion/pose/matching/scan_points.hpp"
#include "fusion/pose/odometry/scan_odometry.hpp"
#include "fusion/pose/tracks/odometry_track.hpp"
#include "protocols/nearest_on_segment.hpp"
#include "tests/fusion/pose/room.hpp"

namespace parhelion::pose {
namespace {

std::vector<Eigen::Vector2d> points_from(const Pose2& T_map_base, std::mt19937& random,
                                         const Twist2& twist = {}) {
  const RobotDescription robot = test::robot_with_laser();
  const Scan scan = test::scan_from(test::ring_building(), robot, T_map_base, twist, SensorTime{}, random);
  return deskewed(scan, *robot.laser, twist).points;
}

SurfelMap surfels_of_the_building(std::mt19937& random, double cell = 0.1) {
  SurfelMap map(cell);
  for (double x = 1; x < 11; x += 0.25) map.add(points_from({x, 1.3, 0.1 * x}, random), {x, 1.3, 0.1 * x});
  return map;
}

TEST(SurfelMap, LookUpEqualsBruteForceOverAllCells) {
  std::mt19937 random(1);
  const SurfelMap map = surfels_of_the_building(random);
  std::uniform_real_distribution<double> x(-1, 13), y(-1, 9);
  int found = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector2d p(x(random), y(random));
    const Surfel* fast = map.nearest(p);
    EXPECT_EQ(fast, map.nearest_slow(p));
    found += fast != nullptr ? 1 : 0;
  }
  EXPECT_GT(found, 20);
}

TEST(SurfelMap, RemovalLeavesNothingBehind) {
  std::mt19937 random(2);
  const Pose2 here{5, 1.3, 0}, there{8, 1.4, 0.3};
  const auto a = points_from(here, random), b = points_from(there, random);
  SurfelMap both(0.1), only(0.1);
  both.add(a, here);
  both.add(b, there);
  both.add(b, there, -1);
  only.add(a, here);
  std::uniform_real_distribution<double> x(0, 12), y(0, 8);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d p(x(random), y(random));
    const Surfel *left = both.nearest(p), *expected = only.nearest(p);
    ASSERT_EQ(left == nullptr, expected == nullptr);
    if (left == nullptr) continue;
    EXPECT_LT((left->mean - expected->mean).norm(), 1e-6);
    EXPECT_EQ(left->flat, expected->flat);
  }
}

TEST(ScanMatch, FindsThePoseToMillimetresFromAStartNearby) {
  std::mt19937 random(3);
  const SurfelMap map = surfels_of_the_building(random);
  std::uniform_real_distribution<double> off(-0.08, 0.08);
  for (int i = 0; i < 40; ++i) {
    const Pose2 truth{2 + 0.2 * i, 1.3 + off(random), 0.05 * i};
    const auto points = points_from(truth, random);
    const Pose2 start = truth * Pose2{off(random), off(random), off(random) / 2};
    const Match found = match(map, points, start, start, Eigen::Matrix3d::Zero(), {});
    EXPECT_LT((found.T_map_base.position() - truth.position()).norm(), 0.015) << i;
    EXPECT_LT(std::abs(wrap_angle(found.T_map_base.yaw - truth.yaw)), 0.005) << i;
  }
}

TEST(ScanMatch, ACorridorLeavesItsLengthUndetermined) {
  std::mt19937 random(4);
  std::vector<test::Segment> corridor{{{-50, -1}, {50, -1}}, {{-50, 1}, {50, 1}}};
  const RobotDescription robot = test::robot_with_laser();
  SurfelMap map(0.1);
  std::vector<Eigen::Vector2d> points;
  for (double x = -3; x <= 3; x += 0.2) {
    points = deskewed(test::scan_from(corridor, robot, {x, 0, 0}, {}, SensorTime{}, random), *robot.laser, {})
                 .points;
    map.add(points, {x, 0, 0});
  }
  const Match found = match(map, points, {3, 0.02, 0.01}, {3, 0, 0}, Eigen::Matrix3d::Zero(), {});
  EXPECT_LT(found.information(0, 0), 0.02 * found.information(1, 1));
  EXPECT_NEAR(found.T_map_base.y, 0, 0.01);
}

TEST(CorrelativeMap, BranchAndBoundEqualsExhaustiveSearch) {
  std::mt19937 random(5);
  std::vector<Eigen::Vector2d> map_points;
  for (double x = 1; x < 11; x += 0.5) {
    for (const auto& p : points_from({x, 1.3, 0}, random)) map_points.push_back(Pose2{x, 1.3, 0} * p);
  }
  const CorrelativeMap map(map_points, 0.1, 6);
  std::uniform_real_distribution<double> off(-0.6, 0.6);
  for (int i = 0; i < 10; ++i) {
    const Pose2 truth{3 + 0.6 * i, 1.4, 0.1 * i};
    const auto points = thinned(points_from(truth, random), 60);
    const CorrelativeMap::Window window{truth * Pose2{off(random), off(random), off(random) / 3}, 0.9, 0.9,
                                        0.3};
    const auto fast = map.search(points, window, {});
    const auto slow = map.search_slow(points, window, {});
    ASSERT_EQ(fast.size(), 1U);
    ASSERT_EQ(slow.size(), 1U);
    EXPECT_EQ(fast.front().score, slow.front().score);
    EXPECT_LT((fast.front().T_map_base.position() - truth.position()).norm(), 0.25);
  }
}

TEST(Deskewed, MovingAndStandingRobotsGiveTheSameScan) {
  std::mt19937 random(6);
  const std::vector<test::Segment> walls = test::ring_building();
  RobotDescription robot = test::robot_with_laser();
  const Twist2 twist{1.5, 0, 1.2};
  const Pose2 pose{5, 1.3, 0.2};
  const Scan moving = test::scan_from(walls, robot, pose, twist, SensorTime{}, random, 0);
  double corrected = 0, raw = 0;
  const auto distance_to_walls = [&](const Eigen::Vector2d& p) {
    double nearest = 1e9;
    for (const auto& wall : walls) {
      nearest = std::min(nearest, (nearest_on_segment(p, wall.a, wall.b) - p).norm());
    }
    return nearest;
  };
  for (const auto& p : deskewed(moving, *robot.laser, twist).points)
    corrected = std::max(corrected, distance_to_walls(pose * p));
  for (const auto& p : deskewed(moving, *robot.laser, {}).points)
    raw = std::max(raw, distance_to_walls(pose * p));
  EXPECT_LT(corrected, 1e-3);
  EXPECT_GT(raw, 0.02);
}

TEST(Deskewed, RectifiedScansLieOnTheSameWalls) {
  std::mt19937 random(7);
  const RobotDescription robot = test::robot_with_laser();
  const Twist2 twist{0.8, 0, 1.0};
  const Pose2 pose{5, 1.3, 0.2};
  const Scan moving = test::scan_from(test::ring_building(), robot, pose, twist, SensorTime{}, random, 0);
  const Scan standing = test::scan_from(test::ring_building(), robot, pose, {}, SensorTime{}, random, 0);
  const Scan laid = rectified(deskewed(moving, *robot.laser, twist), *robot.laser);
  ASSERT_EQ(laid.ranges.size(), standing.ranges.size());
  int close = 0, known = 0;
  for (std::size_t i = 0; i < laid.ranges.size(); ++i) {
    if (std::isnan(laid.ranges[i])) continue;
    ++known;
    close += std::abs(laid.ranges[i] - standing.ranges[i]) < 0.02F ? 1 : 0;
  }
  EXPECT_GT(known, 340);
  EXPECT_GT(close, known * 95 / 100) << "only edges may differ";
}

TEST(PoseGraph, DistributesLoopErrorAndIgnoresFalseLoops) {
  std::vector<Pose2> truth, drifted;
  std::vector<PoseGraphEdge> edges;
  const Eigen::Matrix3d information = Eigen::Vector3d(1e4, 1e4, 4e4).asDiagonal();
  for (int i = 0; i < 40; ++i)
    truth.push_back(i == 0 ? Pose2{} : truth.back() * Pose2{0.5, 0, 2 * std::numbers::pi / 40});
  drifted.push_back({});
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Pose2 measured = truth[i - 1].inverse() * truth[i] * Pose2{0.002, 0, 0.004};
    edges.push_back({i - 1, i, measured, information, false});
    drifted.push_back(drifted.back() * measured);
  }
  edges.push_back({0, 39, truth[0].inverse() * truth[39], information, true});
  edges.push_back({1, 38, truth[1].inverse() * truth[38], information, true});
  edges.push_back({5, 20, Pose2{0.1, 0.1, 2}, information, true});
  const auto found = optimize_pose_graph(drifted, edges, 8);
  double worst_before = 0, worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    worst_before = std::max(worst_before, (drifted[i].position() - truth[i].position()).norm());
    worst = std::max(worst, (found[i].position() - truth[i].position()).norm());
  }
  EXPECT_GT(worst_before, 0.3);
  EXPECT_LT(worst, 0.25 * worst_before);
  EXPECT_EQ(found[0].x, 0);
}

TEST(ScanOdometry, StampJitterDoesNotInflateTheSpeed) {
  ScanOdometry odometry;
  OdometryTrack brief(seconds(2), milliseconds(500));
  double fastest = 0;
  std::mt19937 random(8);
  std::uniform_real_distribution<double> jitter(-0.045, 0.045);
  for (int i = 0; i < 60; ++i) {
    const double t = 0.1 * i;
    const Odometry sample{SensorTime{} + seconds(1 + t + jitter(random)),
                          transform<Odom, Base>(moved({0.5, 0, 0.8}, t))};
    odometry.add(sample);
    brief.add(sample);
    if (const auto there = brief.at(SensorTime{} + seconds(1 + t))) {
      fastest = std::max(fastest, there->twist.wz);
    }
    const auto step = odometry.step_to(SensorTime{} + seconds(1 + t));
    ASSERT_TRUE(step);
    EXPECT_LT(step->twist.wz, 0.8 * 1.5);
    EXPECT_GE(step->twist.wz, 0);
  }
  EXPECT_GT(fastest, 0.8 * 1.6) << "without caution";
}

TEST(ScanOdometry, FollowsARobotThatBeginsToTurnDuringALongSweep) {
  constexpr double acceleration = 2;  // rad/s^2
  LaserDescription laser;
  laser.beam_interval = 0.16 / 359;
  const Scan scan{SensorTime{} + seconds(1.2), std::vector<float>(360, 1.0F), {}, 0, 0.01745F, {}, {}};
  const auto yaw_at = [](double t) { return t < 1 ? 0 : acceleration * (t - 1) * (t - 1) / 2; };
  for (const double arrived : {1.4, 1.2}) {
    ScanOdometry odometry;
    for (double t = 0; t < arrived + 1e-9; t += 0.02)
      odometry.add({SensorTime{} + seconds(t), transform<Odom, Base>(Pose2{0, 0, yaw_at(t)})});
    const auto step = odometry.step_to(scan, laser);
    ASSERT_TRUE(step);
    for (const double dt : {0.04, 0.08, 0.16}) {
      const double off = std::abs(step->sweep.after(dt).yaw - (yaw_at(1.2 + dt) - yaw_at(1.2)));
      if (arrived > 1.36) {
        EXPECT_LT(off, 0.001) << dt;
      } else {
        EXPECT_LT(off, 0.08) << dt << ": by what it was before";
      }
    }
  }
}

TEST(ScanOdometry, PairsSamplesWithScansByStampInAnyOrder) {
  ScanOdometry odometry;
  odometry.add({SensorTime{} + seconds(10), transform<Odom, Base>(Pose2{1, 0, 0})});
  odometry.step_to(SensorTime{} + seconds(10));
  odometry.add({SensorTime{} + seconds(9.5), transform<Odom, Base>(Pose2{1.2, 0, 0})});
  const auto step = odometry.step_to(SensorTime{} + seconds(9.5));
  ASSERT_TRUE(step);
  EXPECT_NEAR(step->step.x, 0.2, 1e-12);
}

TEST(OdometryTrack, ExtrapolatesTheTwistForALimitedTime) {
  OdometryTrack track(seconds(2), milliseconds(500));
  for (int i = 0; i <= 10; ++i)
    track.add({SensorTime{} + milliseconds(10 * i), transform<Odom, Base>(moved({1, 0, 0.5}, 0.01 * i))});
  const auto ahead = track.at(SensorTime{} + milliseconds(300));
  ASSERT_TRUE(ahead);
  const Pose2 expected = moved({1, 0, 0.5}, 0.3);
  EXPECT_LT((ahead->T_odom_base.position() - expected.position()).norm(), 1e-6);
  OdometryTrack::Missing missing{};
  EXPECT_FALSE(track.at(SensorTime{} + milliseconds(700), &missing));
  EXPECT_EQ(missing, OdometryTrack::Missing::too_far_ahead);
}

}  // namespace
}  // namespace parhelion::pose
