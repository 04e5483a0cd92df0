// The line about a model's quality: three doubtful parts by name, and where the others are.
#include "fusion/semantic/model_quality.hpp"

#include <gtest/gtest.h>

namespace parhelion::semantic {
namespace {

std::string line_with_doubts(int count) {
  ModelQuality quality;
  for (int k = 1; k <= count; ++k)
    quality.doubts.push_back({"wall " + std::to_string(k), Eigen::Vector3d::Zero(), 1, "thin"});
  return quality_line(quality);
}

TEST(ModelQuality, TheLineNamesThreeDoubtsAndWhereTheOthersAre) {
  EXPECT_NE(line_with_doubts(0).find("no doubtful part"), std::string::npos);
  EXPECT_NE(line_with_doubts(1).find("1 doubtful part: wall 1 (thin)"), std::string::npos);
  EXPECT_EQ(line_with_doubts(3).find("more"), std::string::npos) << line_with_doubts(3);
  const std::string five = line_with_doubts(5);
  EXPECT_NE(five.find("5 doubtful parts: wall 1"), std::string::npos) << five;
  EXPECT_EQ(five.find("wall 4"), std::string::npos) << five;
  EXPECT_NE(five.find("and 2 more (`doubts` in the model has all)"), std::string::npos) << five;
}

TEST(ModelQuality, AMissingFloorIsADoubtWithItsPlace) {
  BuiltModel built;
  built.cloud.points = {{1, 2, 0.3F}, {5, 4, 2}};
  built.cloud.labels.assign(2, static_cast<std::uint8_t>(EntityLabel::wall));
  built.object_of.assign(2, kNoObject);
  const ModelQuality without = quality_of(built);
  ASSERT_EQ(without.doubts.size(), 1U);
  EXPECT_EQ(without.doubts[0].entity, "floor");
  EXPECT_LT((without.doubts[0].place - Eigen::Vector3d(3, 3, 0.3)).norm(), 0.01);
  EXPECT_NEAR(without.doubts[0].extent, 4, 0.01);
  EXPECT_NE(quality_line(without).find("no floor;"), std::string::npos) << quality_line(without);
  ModelEntity floor;
  floor.label = EntityLabel::floor;
  floor.size = {4, 2, 0.1};
  built.model.entities.push_back(floor);
  EXPECT_TRUE(quality_of(built).doubts.empty());
  EXPECT_EQ(quality_line(quality_of(built)).find("no floor;"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::semantic
