// Kerbs between two grounds, and what is none: flights, ramps, plates of furniture, a doubled floor.
#include "fusion/semantic/objects/find_kerbs.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/degree.hpp"
#include "tests/fusion/semantic/clouds.hpp"
#include "tests/model_box.hpp"

namespace parhelion::semantic {
namespace {

using test::CloudSampler;
using test::kDegree;

/// Kerbs in what `draw` draws, all of it called floor, turned by `yaw`.
template <class Draw>
std::vector<ModelObject> kerbs_in(Draw&& draw, double yaw = 0,
                                  const std::vector<ModelEntity>& entities = {}) {
  CloudSampler sampler(250, 0.005, 23);
  draw(sampler);
  cloud::PointCloud<Map> cloud;
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisf(static_cast<float>(yaw), Eigen::Vector3f::UnitZ()).toRotationMatrix();
  for (const Eigen::Vector3f& p : sampler.cloud().points) cloud.points.emplace_back(turn * p);
  const std::vector<std::uint8_t> labels(cloud.size(), static_cast<std::uint8_t>(EntityLabel::floor));
  return find_kerbs(cloud, labels, entities);
}

/// A street with its pavement from y = 3 on.
void draw_street(CloudSampler& s, double high, bool face) {
  s.slab({0, 0}, {8, 3}, 0);
  s.slab({0, 3}, {8, 6}, high);
  if (face) s.wall({0, 3}, {8, 3}, 0, high);
}

TEST(FindKerbs, MeasuresAKerbInAnyDirection) {
  for (const double high : {0.07, 0.12, 0.2}) {
    for (const double yaw : {0.0, 0.3, 0.8, 1.57, 2.5, -2.0}) {
      for (const bool face : {true, false}) {
        const auto kerbs = kerbs_in([&](CloudSampler& s) { draw_street(s, high, face); }, yaw);
        ASSERT_EQ(kerbs.size(), 1U) << high << " " << yaw << " " << face;
        const ModelObject& kerb = kerbs[0];
        EXPECT_EQ(kerb.kind, ObjectKind::kerb);
        EXPECT_FALSE(kerb.movable);
        EXPECT_NEAR(kerb.size.z(), high, 0.01);
        EXPECT_NEAR(kerb.size.x(), 8, 0.5);
        const Eigen::Matrix3d back(Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()));
        for (const double end : {-0.5, 0.5}) {
          const Eigen::Vector3d p =
              back * (kerb.T_map_body * Eigen::Vector3d(end * kerb.size.x(), -kerb.size.y() / 2, 0));
          EXPECT_NEAR(p.y(), 3, 0.03) << high << " " << yaw << " " << face;
        }
        const Eigen::Vector3d up = back * kerb.T_map_body.rotation().col(1);
        EXPECT_NEAR(up.y(), 1, 0.01) << "its y points to the higher side";
      }
    }
  }
}

TEST(FindKerbs, BothEdgesOfARaisedPath) {
  EXPECT_EQ(kerbs_in([](CloudSampler& s) {
              s.slab({0, 0}, {8, 3}, 0);
              s.slab({0, 3}, {8, 5}, 0.12);
              s.slab({0, 5}, {8, 8}, 0);
            }).size(),
            2U);
}

TEST(FindKerbs, NoneWhereTheGroundIsLevelOrTheStepTooHighOrTooLow) {
  for (const double high : {0.0, 0.03, 0.3, 0.45})
    EXPECT_TRUE(kerbs_in([&](CloudSampler& s) { draw_street(s, high, true); }).empty()) << high;
}

TEST(FindKerbs, AFlightHasNone) {
  for (const double tread : {0.28, 0.4}) {
    EXPECT_TRUE(kerbs_in([&](CloudSampler& s) {
                  s.slab({0, 0}, {4, 4}, 0);
                  for (int k = 0; k < 4; ++k) {
                    s.wall({4 + k * tread, 0}, {4 + k * tread, 4}, 0.16 * k, 0.16 * (k + 1));
                    s.slab({4 + k * tread, 0}, {4 + (k + 1) * tread, 4}, 0.16 * (k + 1));
                  }
                  s.slab({4 + 4 * tread, 0}, {10, 4}, 0.64);
                }).empty())
        << tread;
  }
}

TEST(FindKerbs, TheSideOfARampIsNone) {
  EXPECT_TRUE(kerbs_in([](CloudSampler& s) {
                s.slab({0, 0}, {8, 3}, 0);
                s.rectangle({0, 3, 0}, {8, 0, 0.4}, {0, 2, 0});
              }).empty());
}

TEST(FindKerbs, WhatIsAStepOfAFlightAlreadyIsNone) {
  ModelEntity step = test::model_box("stairs 1 step 1", EntityLabel::stairs, {4, 4.5, 0.06}, {8, 3, 0.12});
  EXPECT_TRUE(kerbs_in([](CloudSampler& s) { draw_street(s, 0.12, true); }, 0, {step}).empty());
  step.deleted = true;
  EXPECT_EQ(kerbs_in([](CloudSampler& s) { draw_street(s, 0.12, true); }, 0, {step}).size(), 1U);
}

TEST(FindKerbs, AFloorMeasuredTwiceAtTwoHeightsHasNone) {
  EXPECT_TRUE(kerbs_in([](CloudSampler& s) {
                s.slab({0, 0}, {8, 3.5}, 0);
                s.slab({0, 2.5}, {8, 6}, 0.08);
              }).empty());
}

TEST(FindKerbs, NothingAtAllHasNone) {
  EXPECT_TRUE(find_kerbs({}, {}, {}).empty());
  EXPECT_TRUE(kerbs_in([](CloudSampler& s) { s.slab({0, 0}, {0.3, 0.3}, 0); }).empty());
}

}  // namespace
}  // namespace parhelion::semantic
