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

class UnitDoubt : public testing::TestWithParam<std::uint64_t> {};

TEST_P(UnitDoubt, IsReportedOfFlatsInFeet) {
  ModelOptions options;
  options.unit_advice = ": give it";
  const auto built =
      build_model(scaled(scan(test::SiteKind::flat, test::Device::terrestrial, GetParam()), kFeet), options);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_THAT(built->unit_doubt, HasSubstr("feet (0.3048 m): give it"));
  EXPECT_THAT(quality_of(*built).doubts, Contains(Field(&ModelDoubt::entity, "unit")));
}

TEST_P(UnitDoubt, IsNoneInMetres) {
  for (const auto kind : {test::SiteKind::flat, test::SiteKind::office, test::SiteKind::stair_hall}) {
    const auto built = build_model(scan(kind, test::Device::unplaced, GetParam()));
    ASSERT_TRUE(built) << built.error().message;
    EXPECT_EQ(built->unit_doubt, "");
  }
}

TEST_P(UnitDoubt, IsNoneInAHallWithoutDoors) {
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

INSTANTIATE_TEST_SUITE_P(Seeds, UnitDoubt, testing::Values(111, 112, 113));

}  // namespace
}  // namespace parhelion::semantic
