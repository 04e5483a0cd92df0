// Clouds in feet become models that say so; clouds in metres do not.
#include "fusion/semantic/unit_doubt.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "fusion/cloud/read_cloud.hpp"
#include "fusion/semantic/build_model.hpp"
#include "fusion/semantic/model_quality.hpp"
#include "tests/fusion/semantic/clouds.hpp"
#include "tests/mean_sites/mean_scan.hpp"
#include "tests/mean_sites/mean_site.hpp"

namespace parhelion::semantic {
namespace {

using testing::Contains;
using testing::Field;
using testing::HasSubstr;

cloud::PointCloud<Cloud> scaled(cloud::PointCloud<Cloud> cloud, double by) {
  for (Eigen::Vector3f& p : cloud.points) p *= static_cast<float>(by);
  for (Eigen::Vector3d& p : cloud.viewpoints) p *= by;
  return cloud;
}

cloud::PointCloud<Cloud> scan(test::SiteKind kind, test::Device device, std::uint64_t seed) {
  return test::mean_scan(test::mean_site(kind, seed), device, seed).cloud;
}

constexpr double kFeet = 1 / 0.3048;

class UnitsOfSites : public testing::TestWithParam<std::uint64_t> {};

TEST_P(UnitsOfSites, IsReportedOfFlatsInFeet) {
  ModelOptions options;
  options.unit_advice = ": give it";
  const auto built =
      build_model(scaled(scan(test::SiteKind::flat, test::Device::terrestrial, GetParam()), kFeet), options);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_THAT(built->unit_doubt, HasSubstr("feet (0.3048 m): give it"));
  EXPECT_THAT(quality_of(*built).doubts, Contains(Field(&ModelDoubt::entity, "unit")));
}

TEST(UnitDoubt, IsNoneWhereTheUnitWasGiven) {
  ModelOptions options;
  options.unit_known = true;
  const auto built =
      build_model(scaled(scan(test::SiteKind::flat, test::Device::terrestrial, 111), kFeet), options);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_TRUE(unit_to_try(built->model));
  EXPECT_EQ(built->unit_doubt, "");
}

TEST(UnitDoubt, GatesOfHallsAreNoDoorsInFeet) {
  const auto door = [](double width, double confidence) {
    ModelEntity e;
    e.label = EntityLabel::door, e.size = {width, 0.1, 2}, e.confidence = confidence;
    return e;
  };
  SemanticModel in_feet;
  in_feet.entities = {door(0.91, 0.9)};  // a gate 3 m wide
  EXPECT_FALSE(fits_people(in_feet));
  in_feet.entities = {door(0.91, 0.9), door(0.9, 0.5)};
  EXPECT_FALSE(fits_people(in_feet));
  in_feet.entities = {door(0.91, 0.9), door(0.91, 0.9), door(1.5, 0.9)};  // the third is 5 m wide
  EXPECT_FALSE(fits_people(in_feet));
  in_feet.entities = {door(0.91, 0.9), door(0.8, 0.9)};
  EXPECT_TRUE(fits_people(in_feet));
}

TEST_P(UnitsOfSites, IsNoneInAHallWithAGate) {
  constexpr double kLeft = 4, kWide = 3, kTop = 6.6, kHeight = 8, kReveal = 0.4;  // m
  test::CloudSampler sampler(250, 0.005, GetParam());
  sampler.slab({0, 0}, {24, 15}, 0), sampler.slab({0, 0}, {24, 15}, kHeight);
  sampler.wall({24, 0}, {24, 15}, 0, kHeight), sampler.wall({24, 15}, {0, 15}, 0, kHeight);
  sampler.wall({0, 15}, {0, 0}, 0, kHeight), sampler.wall({0, 0}, {kLeft, 0}, 0, kHeight);
  sampler.wall({kLeft, 0}, {kLeft + kWide, 0}, kTop, kHeight);
  sampler.wall({kLeft + kWide, 0}, {24, 0}, 0, kHeight);
  for (const double x : {kLeft, kLeft + kWide}) sampler.wall({x, 0}, {x, -kReveal}, 0, kTop);
  sampler.slab({kLeft, -kReveal}, {kLeft + kWide, 0}, kTop);
  sampler.slab({kLeft - 1, -5}, {kLeft + kWide + 1, 0}, 0);
  cloud::PointCloud<Cloud> cloud;
  cloud.points = sampler.cloud().points;
  const auto built = build_model(cloud);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_TRUE(unit_to_try(built->model));
  EXPECT_EQ(built->unit_doubt, "");
}

TEST_P(UnitsOfSites, IsNoneInMetres) {
  for (const auto kind : {test::SiteKind::flat, test::SiteKind::office, test::SiteKind::stair_hall}) {
    const auto built = build_model(scan(kind, test::Device::unplaced, GetParam()));
    ASSERT_TRUE(built) << built.error().message;
    EXPECT_EQ(built->unit_doubt, "");
  }
}

TEST_P(UnitsOfSites, IsNoneInAHallWithoutDoors) {
  test::CloudSampler sampler(150, 0.005, GetParam());
  sampler.room({0, 0}, {24, 15}, 0, 8);
  for (int i = 0; i < 12; ++i) {
    const double x = 1 + 20 * sampler.uniform(), y = 1 + 11 * sampler.uniform(),
                 h = 0.5 + 3 * sampler.uniform();
    sampler.slab({x, y}, {x + 1.5, y + 1.2}, h);
    sampler.wall({x, y}, {x + 1.5, y}, 0, h);
    sampler.wall({x, y}, {x, y + 1.2}, 0, h);
  }
  cloud::PointCloud<Cloud> cloud;
  cloud.points = sampler.cloud().points;
  const auto built = build_model(cloud);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_TRUE(unit_to_try(built->model));
  EXPECT_EQ(built->unit_doubt, "");
}

TEST(UnitsOfClouds, FeetAndInchesBecomeMetres) {
  for (const auto& [unit, metres] :
       {std::pair(cloud::LengthUnit::foot, 0.3048), std::pair(cloud::LengthUnit::inch, 0.0254)}) {
    cloud::ReadOptions options;
    options.unit = unit;
    const auto read = cloud::parse_scan("10 20 30\n-1 2 -3\n", "cloud.xyz", cloud::ScanFormat::xyz, options);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(
        read->cloud.points[0].isApprox(static_cast<float>(metres) * Eigen::Vector3f(10, 20, 30), 1e-5F));
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, UnitsOfSites, testing::Values(111, 112, 113));

}  // namespace
}  // namespace parhelion::semantic
