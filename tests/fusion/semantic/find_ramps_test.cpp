// Ramps between floors, and what is none: kerbs, stairs, roofs, bowed floors.
#include "fusion/semantic/net/find_ramps.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fusion/semantic/build_model.hpp"
#include "tests/degree.hpp"
#include "tests/fusion/semantic/clouds.hpp"

namespace parhelion::semantic {
namespace {

using test::CloudSampler;
using test::kDegree;

constexpr double kFrom = 3, kWide = 1.4;  // m, where a ramp begins along x; its width, from y = 0 on

/// A hall, from x = `head` on higher by `up`, with a ramp from kFrom to there.
struct RampHall {
  double up, head;
  cloud::PointCloud<Map> cloud;
  std::vector<std::uint8_t> labels;
};

RampHall hall_with_ramp(double up, double slope, double sigma, std::uint64_t seed) {
  RampHall hall{up, kFrom + up / slope, {}, {}};
  CloudSampler sampler(250, sigma, seed);
  sampler.slab({0, 0}, {kFrom, 6}, 0);
  sampler.slab({kFrom, kWide}, {hall.head, 6}, 0);
  sampler.rectangle({kFrom, 0, 0}, {hall.head - kFrom, 0, up}, {0, kWide, 0});
  const std::size_t on_ramp = sampler.cloud().points.size();
  sampler.slab({hall.head, 0}, {hall.head + 4, 6}, up);
  sampler.wall({hall.head, kWide}, {hall.head, 6}, 0, up);
  hall.cloud.points = sampler.cloud().points;
  // Labels as region growing leaves them: the ramp's lower part is floor, the rest is unknown.
  for (std::size_t i = 0; i < hall.cloud.size(); ++i) {
    const Eigen::Vector3f& p = hall.cloud.points[i];
    const bool loose = i < on_ramp && p.z() > 0.1F;
    const bool riser = i >= on_ramp && static_cast<double>(p.z()) < up - 0.03;
    hall.labels.push_back(
        static_cast<std::uint8_t>(loose || riser ? EntityLabel::unknown : EntityLabel::floor));
  }
  return hall;
}

TEST(FindRamps, MeasuresARampBetweenTwoFloors) {
  std::uint64_t seed = 1;
  for (const double up : {0.25, 0.5, 1.0}) {
    for (const double slope : {1.0 / 12, 0.15, 0.25}) {
      RampHall hall = hall_with_ramp(up, slope, 0.006, ++seed);
      const std::vector<ModelEntity> found = find_ramps(hall.cloud, hall.labels).ramps;
      ASSERT_EQ(found.size(), 1U) << up << " " << slope;
      const Eigen::Isometry3d T = found[0].T_map_body.isometry();
      const Eigen::Vector3d foot = T * Eigen::Vector3d(-found[0].size.x() / 2, 0, found[0].size.z() / 2),
                            head = T * Eigen::Vector3d(found[0].size.x() / 2, 0, found[0].size.z() / 2);
      EXPECT_NEAR(std::asin(T.linear()(2, 0)), std::atan(slope), 0.3 * kDegree);
      EXPECT_NEAR((foot - Eigen::Vector3d(kFrom, kWide / 2, 0)).norm(), 0, 0.12) << foot.transpose();
      EXPECT_NEAR((head - Eigen::Vector3d(hall.head, kWide / 2, up)).norm(), 0, 0.12) << head.transpose();
      EXPECT_NEAR(found[0].size.y(), kWide, 0.08);
      EXPECT_EQ(found[0].label, EntityLabel::ramp);
    }
  }
}

TEST(FindRamps, LabelTheirPointsAndNoOthers) {
  RampHall hall = hall_with_ramp(0.6, 0.12, 0.006, 5);
  const std::vector<std::uint8_t> before = hall.labels;
  find_ramps(hall.cloud, hall.labels);
  double on = 0, right = 0, wrong = 0;
  for (std::size_t i = 0; i < hall.cloud.size(); ++i) {
    const Eigen::Vector3d p = hall.cloud.points[i].cast<double>();
    const bool there = p.x() > kFrom + 0.3 && p.x() < hall.head - 0.1 && p.y() < kWide;
    on += there;
    right += there && hall.labels[i] == static_cast<std::uint8_t>(EntityLabel::ramp);
    const bool far = p.x() < kFrom - 0.3 || p.x() > hall.head + 0.3 || p.y() > kWide + 0.15;
    wrong += far && hall.labels[i] != before[i];
  }
  EXPECT_GT(right, 0.97 * on);
  EXPECT_EQ(wrong, 0);
}

/// Number of ramps in what `draw` draws, all of it called floor.
template <class Draw>
std::size_t ramps_in(Draw&& draw, EntityLabel label = EntityLabel::floor) {
  CloudSampler sampler(250, 0.006, 17);
  draw(sampler);
  cloud::PointCloud<Map> cloud;
  cloud.points = sampler.cloud().points;
  std::vector<std::uint8_t> labels(cloud.size(), static_cast<std::uint8_t>(label));
  return find_ramps(cloud, labels).ramps.size();
}

TEST(FindRamps, AKerbIsNone) {
  for (const double kerb : {0.04, 0.08, 0.12, 0.16, 0.2}) {
    EXPECT_EQ(ramps_in([&](CloudSampler& s) {
                s.slab({0, 0}, {8, 3}, 0);
                s.slab({0, 3}, {8, 6}, kerb);
                s.wall({0, 3}, {8, 3}, 0, kerb);
              }),
              0U)
        << kerb;
  }
}

TEST(FindRamps, AFlightOfStepsIsNone) {
  for (const double tread : {0.28, 0.36, 0.6}) {
    EXPECT_EQ(ramps_in([&](CloudSampler& s) {
                s.slab({0, 0}, {3, 2}, 0);
                for (int i = 0; i < 6; ++i) {
                  const double x = 3 + i * tread, z = 0.15 * i;
                  s.wall({x, 0}, {x, 2}, z, z + 0.15);
                  s.slab({x, 0}, {x + (i == 5 ? 3 : tread), 2}, z + 0.15);
                }
              }),
              0U)
        << tread;
  }
}

TEST(FindRamps, ARoofThatNoFloorLeadsToIsNone) {
  EXPECT_EQ(ramps_in([](CloudSampler& s) {
              s.slab({0, 0}, {8, 6}, 0);
              s.rectangle({2, 1, 2}, {3, 0, 0.6}, {0, 4, 0});
            }),
            0U);
}

TEST(FindRamps, AFloorThatLeansALittleIsNone) {
  EXPECT_EQ(ramps_in([](CloudSampler& s) {
              s.slab({0, 0}, {4, 6}, 0);
              s.rectangle({4, 0, 0}, {6, 0, 0.2}, {0, 6, 0});  // 1:30
            }),
            0U);
}

/// A level floor and a ramp of 0.1 m beyond 3 m, seen by a scanner 0.4 m over it whose angles are wrong: by
/// `noise` (rad, 1 sigma) for each point, by up to `bend` (rad) from one direction to another.
std::vector<ModelEntity> ramps_seen_with(double noise, double bend = 0) {
  CloudSampler sampler(200, 0.004, 23);
  sampler.slab({0.5, -2}, {3, 2}, 0);
  sampler.rectangle({3, -2, 0}, {1, 0, 0.1}, {0, 4, 0});
  sampler.slab({4, -2}, {7, 2}, 0.1);
  cloud::PointCloud<Map> cloud;
  cloud.points = sampler.cloud().points;
  cloud.viewpoints = {{0, 0, 0.4}};
  cloud.scans.assign(cloud.size(), 0);
  for (Eigen::Vector3f& p : cloud.points) {
    const double off =
        noise * sampler.gaussian() +
        bend * std::sin(2 * std::atan2(static_cast<double>(p.y()), static_cast<double>(p.x())));
    p.z() += static_cast<float>(off) * p.head<2>().norm();
  }
  std::vector<std::uint8_t> labels(cloud.size(), static_cast<std::uint8_t>(EntityLabel::floor));
  return find_ramps(cloud, labels).ramps;
}

TEST(FindRamps, WhatTheScannersAnglesMayHaveBentIsNone) {
  EXPECT_EQ(ramps_seen_with(0.001).size(), 1U);
  EXPECT_EQ(ramps_seen_with(0.02).size(), 0U);
}

TEST(FindRamps, AreLessSureTheMoreOfTheirRiseTheScannersAnglesMayExplain) {
  const auto sure = ramps_seen_with(0), doubtful = ramps_seen_with(0, 0.012);
  ASSERT_EQ(sure.size(), 1U);
  ASSERT_EQ(doubtful.size(), 1U);
  EXPECT_DOUBLE_EQ(sure[0].confidence, sure[0].observed);
  EXPECT_LT(doubtful[0].confidence, 0.9 * doubtful[0].observed);
  EXPECT_GT(doubtful[0].confidence, 0.5 * doubtful[0].observed);
}

TEST(FindRamps, LevelsOfAVoxelMapAreNone) {
  // Heights in a map of 10 cm come in steps of 10 cm; spread over planes they look like short slopes.
  CloudSampler sampler(250, 0.004, 3);
  sampler.slab({0, 0}, {4, 6}, 0);
  sampler.rectangle({4, 0, 0}, {0.6, 0, 0.1}, {0, 6, 0});
  sampler.slab({4.6, 0}, {9, 6}, 0.1);
  cloud::PointCloud<Map> cloud;
  cloud.points = sampler.cloud().points;
  std::vector<std::uint8_t> labels(cloud.size(), static_cast<std::uint8_t>(EntityLabel::floor));
  std::vector<std::uint8_t> again = labels;
  EXPECT_EQ(find_ramps(cloud, labels, 0.10).ramps.size(), 0U);
  EXPECT_EQ(find_ramps(cloud, again).ramps.size(), 1U) << "in a scan it is a ramp";
}

TEST(FindRamps, LeadToAFloorThatDoesNotReachOverThem) {
  const RampHall hall = hall_with_ramp(0.6, 0.15, 0.005, 9);
  cloud::PointCloud<Cloud> cloud;
  cloud.points = hall.cloud.points;
  cloud.viewpoints = {{1.5, 4, 1.5}, {hall.head + 2, 3, 2.1}};
  for (const Eigen::Vector3f& p : cloud.points)
    cloud.scans.push_back(p.x() < static_cast<float>(hall.head) ? 0 : 1);
  const auto built = build_model(cloud);
  ASSERT_TRUE(built.ok()) << built.error().message;
  int ramps = 0;
  bool landing = false;
  for (const ModelEntity& entity : built->model.entities) {
    ramps += entity.label == EntityLabel::ramp;
    if (entity.label != EntityLabel::floor) continue;
    const double top = entity.T_map_body.translation().z() + entity.size.z() / 2;
    landing = landing || (std::abs(top - 0.6) < 0.03 && entity.size.head<2>().minCoeff() > 2);
    for (double x = kFrom + 0.5; x < hall.head - 0.3; x += 0.1) {
      const Eigen::Vector3d p = entity.T_map_body.inverse() * Eigen::Vector3d(x, kWide / 2, 0);
      const bool over = (p.head<2>().cwiseAbs().array() < 0.5 * entity.size.head<2>().array()).all();
      EXPECT_FALSE(over && top > 0.15 * (x - kFrom) + 0.05) << entity.name << " at x = " << x;
    }
  }
  EXPECT_EQ(ramps, 1);
  EXPECT_TRUE(landing) << "no step leads to it, but the ramp does";
}

}  // namespace
}  // namespace parhelion::semantic
