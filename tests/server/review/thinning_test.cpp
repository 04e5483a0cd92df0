// An hour of samples fits on a page, and no peak is lost.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "server/review/nearest_return.hpp"
#include "server/review/series.hpp"
#include "server/review/track.hpp"

namespace parhelion::review {
namespace {

RC_GTEST_PROP(Series, EqualsTheReferenceInEachWindow, ()) {
  const auto steps = *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 400));
  const auto max_windows = static_cast<std::size_t>(*rc::gen::inRange(1, 40));
  Series series(max_windows);
  std::vector<Series::Sample> all;
  double t = 0;
  for (const int step : steps) {
    t += step * 1e-3;
    const double value = *rc::gen::inRange(-50, 50);
    series.add(t, value);
    all.push_back({t, value});
  }
  std::map<long long, std::pair<double, double>> windows;
  for (const auto& sample : all) {
    const auto index = static_cast<long long>(std::floor(sample.t / series.width()));
    auto& [smallest, greatest] = windows.try_emplace(index, sample.value, sample.value).first->second;
    smallest = std::min(smallest, sample.value);
    greatest = std::max(greatest, sample.value);
  }
  RC_ASSERT(windows.size() <= max_windows);
  std::map<long long, std::pair<double, double>> kept;
  double before = -1;
  for (const auto& sample : series.samples()) {
    RC_ASSERT(sample.t >= before);
    before = sample.t;
    const auto index = static_cast<long long>(std::floor(sample.t / series.width()));
    auto& [smallest, greatest] = kept.try_emplace(index, sample.value, sample.value).first->second;
    smallest = std::min(smallest, sample.value);
    greatest = std::max(greatest, sample.value);
  }
  RC_ASSERT(kept == windows);
}

TEST(Series, OmitsNaN) {
  Series series;
  series.add(1, std::numeric_limits<double>::infinity());
  series.add(1, std::nan(""));
  EXPECT_TRUE(series.samples().empty());
}

TEST(Track, AThinnedHourStaysCloseToTheDrivenTrack) {
  Track track(500);
  double driven = 0;
  for (int i = 0; i <= 108'000; ++i) {
    const double t = i / 30.0;
    track.add({t, 2 * std::cos(t / 10), std::sin(t / 10), 0, 0.2, i == 0});
    if (i > 0)
      driven += std::hypot(2 * (std::cos(t / 10) - std::cos((i - 1) / 300.0)),
                           std::sin(t / 10) - std::sin((i - 1) / 300.0));
  }
  const auto points = track.points();
  EXPECT_LE(points.size(), 501U);
  EXPECT_GT(points.size(), 200U);
  EXPECT_NEAR(track.length(), driven, 1e-6 * driven);
  EXPECT_EQ(points.front().t, 0);
  EXPECT_EQ(points.back().t, 3600);
  for (const TrackPoint& point : points) EXPECT_NEAR(point.x * point.x / 4 + point.y * point.y, 1, 1e-9);
}

TEST(Track, AJumpIsNotCountedAsDrivenDistance) {
  Track track(4);
  track.add({0, 0, 0, 0, 0, true});
  for (int i = 1; i <= 6; ++i) track.add({1.0 * i, 0.1 * i, 0, 0, 0.1, false});
  track.add({7, 50, 0, 0, 0, true});
  track.add({8, 50.5, 0, 0, 0.5, false});
  EXPECT_NEAR(track.length(), 1.1, 1e-9);
  const auto points = track.points();
  std::size_t jumps = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (points[i].after_jump)
      ++jumps;
    else
      EXPECT_LT(std::abs(points[i].x - points[i - 1].x), 1);
  }
  EXPECT_EQ(jumps, 1U);
}

RobotDescription robot_with_laser() {
  RobotDescription robot;
  LaserDescription laser;
  laser.T_base_laser = Transform<Base, Laser>::planar(0.2, 0.1, 0.3, 0.4);
  laser.convention = {0.05F, 30, RangeConvention::Sentinel::value, 81.83F, RangeConvention::Sentinel::value,
                      0};
  robot.laser = laser;
  robot.footprint = {{-0.4, -0.3}, {0.4, -0.3}, {0.5, 0}, {0.4, 0.3}, {-0.4, 0.3}};
  return robot;
}

RC_GTEST_PROP(NearestReturn, EqualsTheMinimumOverAllReturns, ()) {
  const RobotDescription robot = robot_with_laser();
  const LaserDescription& laser = *robot.laser;
  Scan scan;
  scan.angle_min = -1.5F;
  scan.angle_increment = 0.1F;
  ScanInfo info;
  for (int i = 0; i < 31; ++i) {
    const int range = *rc::gen::inRange(0, 1000);
    scan.ranges.push_back(range % 7 == 0 ? 81.83F : static_cast<float>(range) * 0.01F);
    info.beam_agent.push_back(static_cast<std::int16_t>(*rc::gen::inRange(-3, 1)));
  }
  NearestReturn nearest(robot);
  const auto found = nearest.of(scan, &info);
  double any = std::numeric_limits<double>::infinity(), injected = any;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    if (laser.convention.classify(scan.ranges[i]) != BeamKind::hit) continue;
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    const Eigen::Vector3d p = laser.T_base_laser * Eigen::Vector3d(scan.ranges[i] * std::cos(angle),
                                                                   scan.ranges[i] * std::sin(angle), 0);
    const double d = distance_to_outline(p.head<2>(), robot.footprint);
    any = std::min(any, d);
    if (info.beam_agent[i] >= 0) injected = std::min(injected, d);
  }
  RC_ASSERT((found.any == any || std::abs(found.any - any) < 1e-9));
  RC_ASSERT((found.injected == injected || std::abs(found.injected - injected) < 1e-9));
}

TEST(NearestReturn, IsMeasuredFromTheEdgeOfTheOutline) {
  const auto outline = robot_with_laser().footprint;
  EXPECT_NEAR(distance_to_outline({1.5, 0}, outline), 1, 1e-12);
  EXPECT_NEAR(distance_to_outline({0, 1}, outline), 0.7, 1e-12);
  EXPECT_NEAR(distance_to_outline({-0.7, -0.7}, outline), 0.5, 1e-12);
  EXPECT_EQ(distance_to_outline({0.1, 0.1}, outline), 0);
}

}  // namespace
}  // namespace parhelion::review
