#include "tools/cloud_layer.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

#include "tests/number_at.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::tools {
namespace {

using test::number_at;

TEST(CloudLayer, PointsAreTransformedToTheMapFrame) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "room.xyz") << "1 0 0 10 20 30\n2 0 0 10 20 30\n3 0 0 10 20 30\n4 0 0 10 20 30\n";
  const auto T_map_cloud = Transform<Map, Cloud>(
      Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ())), {5, 0, 0.5});
  const auto all = cloud_layer(folder / "room.xyz", T_map_cloud);
  ASSERT_TRUE(all.ok()) << all.error().message;
  ASSERT_EQ(all->size(), 16U + 4 * 16);
  EXPECT_EQ(number_at<std::uint16_t>(*all, 2), 1U) << "has colours";
  EXPECT_EQ(number_at<std::uint32_t>(*all, 4), 4U);
  EXPECT_NEAR(number_at<float>(*all, 16), 5, 1e-6);
  EXPECT_NEAR(number_at<float>(*all, 20), 1, 1e-6);
  EXPECT_NEAR(number_at<float>(*all, 24), 0.5, 1e-6);
  EXPECT_EQ(number_at<std::uint8_t>(*all, 29), 20);

  const auto few = cloud_layer(folder / "room.xyz", T_map_cloud, 3);
  ASSERT_TRUE(few.ok());
  EXPECT_EQ(number_at<std::uint32_t>(*few, 4), 2U) << "every second one";
  EXPECT_EQ(few->size(), 16U + 2 * 16);
}

TEST(CloudLayer, MarksACloudWithoutColours) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "room.xyz") << "1 0 0\n2 0 0\n";
  const auto made = cloud_layer(folder / "room.xyz", {});
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_EQ(number_at<std::uint16_t>(*made, 2), 0U);
}

TEST(CloudLayer, ReportsAFileThatIsNoCloud) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "room.ply") << "no cloud";
  const auto made = cloud_layer(folder / "room.ply", {});
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("room.ply"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::tools
