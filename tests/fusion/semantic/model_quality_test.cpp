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

}  // namespace
}  // namespace parhelion::semantic
