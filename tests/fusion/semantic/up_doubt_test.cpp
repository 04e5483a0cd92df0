// Clouds that are upside down or lie on their side, where what hangs does not refuse them: a doubt is
// reported.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fusion/semantic/build_model.hpp"
#include "fusion/semantic/model_quality.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"
#include "protocols/angle_units.hpp"
#include "tests/fusion/semantic/clouds.hpp"

namespace parhelion::semantic {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::StartsWith;

using Cloud3 = cloud::PointCloud<Cloud>;

Cloud3 sampled_cloud(const test::CloudSampler& sampler) {
  Cloud3 cloud;
  cloud.points = sampler.cloud().points;
  return cloud;
}

void lump(test::CloudSampler& sampler, double x, double y, double z) {
  sampler.clutter({Eigen::Vector3d(x, y, z), Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5)}, 100);
}

/// A room with four tables, and of lumps `bags` that stand and `lamps` that hang.
Cloud3 room(std::uint64_t seed, int bags, int lamps) {
  test::CloudSampler sampler(300, 0.004, seed);
  sampler.room({0, 0}, {10, 7}, 0, 3.2);
  for (const double x : {1.5, 6.5}) {
    for (const double y : {1.2, 4.6}) sampler.slab({x, y}, {x + 1.6, y + 0.8}, 0.74);
  }
  for (int i = 0; i < bags; ++i) lump(sampler, 8.5 * sampler.uniform(), 6 * sampler.uniform(), 0.5);
  for (int i = 0; i < lamps; ++i) lump(sampler, 8.5 * sampler.uniform(), 6 * sampler.uniform(), 2.2);
  return sampled_cloud(sampler);
}

/// Open ground with low things on it.
Cloud3 yard(std::uint64_t seed) {
  test::CloudSampler sampler(150, 0.006, seed);
  sampler.slab({0, 0}, {14, 12}, 0);
  sampler.wall({0, 0}, {14, 0}, 0, 3);
  for (int i = 0; i < 25; ++i) lump(sampler, 13 * sampler.uniform(), 11 * sampler.uniform(), 0.2);
  return sampled_cloud(sampler);
}

/// A shaft that is three times higher than wide, with landings at one end; nothing stands in it.
Cloud3 shaft() {
  test::CloudSampler sampler(200, 0.004, 5);
  sampler.room({0, 0}, {8, 2.7}, 0, 10.4);
  for (const double z : {2.6, 5.2, 7.8}) sampler.slab({0, 0}, {3, 2.7}, z);
  return sampled_cloud(sampler);
}

Cloud3 turned(Cloud3 cloud, const Eigen::Matrix3f& R) {
  for (Eigen::Vector3f& p : cloud.points) p = R * p;
  return cloud;
}

Eigen::Matrix3f about(const Eigen::Vector3f& axis, double degrees) {
  return Eigen::AngleAxisf(static_cast<float>(degrees * kRadiansPerDegree), axis).toRotationMatrix();
}

Cloud3 upside_down(const Cloud3& cloud) { return turned(cloud, about(Eigen::Vector3f::UnitX(), 180)); }

/// The note, or why the cloud is refused; empty: it is taken for right.
std::string doubt(const Cloud3& cloud) {
  UpDoubt doubt;
  const auto T_map_cloud = level(cloud, Eigen::Vector3d::UnitZ(), false, &doubt);
  return T_map_cloud ? doubt.note : T_map_cloud.error().message;
}

TEST(UpDoubt, TopsOfTablesShowWhichSideIsDownWhereAsMuchHangsAsStands) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Cloud3 cloud = room(seed, 12, 20);
    EXPECT_EQ(doubt(cloud), "") << seed;
    EXPECT_THAT(doubt(upside_down(cloud)), HasSubstr("may be upside down")) << seed;
  }
}

TEST(UpDoubt, ARoomWithMoreLampsThanThingsIsNotRefusedIfItsTablesStand) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) EXPECT_EQ(doubt(room(seed, 0, 30)), "") << seed;
}

TEST(UpDoubt, ThingsShowWhichSideOfOpenGroundIsUp) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    EXPECT_EQ(doubt(yard(seed)), "") << seed;
    EXPECT_THAT(doubt(upside_down(yard(seed))), HasSubstr("upside down")) << seed;
  }
}

TEST(UpDoubt, ARoomOnItsSideIsReportedWithTheAxisThatIsUpAndAShaftIsNot) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Cloud3 cloud =
        turned(room(seed, 12, 4), about(Eigen::Vector3f::UnitZ(), 20.0 * static_cast<double>(seed)));
    EXPECT_EQ(doubt(cloud), "") << seed;
    EXPECT_THAT(doubt(turned(cloud, about(Eigen::Vector3f::UnitX(), -90))), HasSubstr("its y axis upwards"))
        << seed;
    EXPECT_THAT(doubt(turned(cloud, about(Eigen::Vector3f::UnitX(), 90))), HasSubstr("its -y axis upwards"))
        << seed;
    EXPECT_THAT(doubt(turned(cloud, about(Eigen::Vector3f::UnitY(), 90))), HasSubstr("its x axis upwards"))
        << seed;
  }
  EXPECT_EQ(doubt(shaft()), "")
      << "a tall shaft looks as a room on its side, but nothing stands on its walls";
}

TEST(UpDoubt, IsInTheNotesAndInTheQualityLineAndNotWhereTheUserGaveTheUpDirection) {
  const Cloud3 cloud = upside_down(room(1, 12, 20));
  ModelOptions options;
  options.up_advice = ": OPTION";
  const auto built = build_model(cloud, options);
  ASSERT_TRUE(built.ok()) << built.error().message;
  EXPECT_THAT(built->notes, Contains(testing::AllOf(HasSubstr("upside down"), HasSubstr(": OPTION"))));
  EXPECT_THAT(quality_line(quality_of(*built)), StartsWith("its up direction is doubtful"));
  options.up = Eigen::Vector3d::UnitZ();
  const auto given = build_model(cloud, options);
  ASSERT_TRUE(given.ok()) << given.error().message;
  EXPECT_FALSE(given->up_doubtful);
}

}  // namespace
}  // namespace parhelion::semantic
