#include "tools/site_map.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "tests/server/tick/synthetic.hpp"

namespace parhelion::tools {
namespace {

cv::Mat picture_of(const station::StationMap& map) {
  const std::vector<std::uint8_t> bytes(map.png.begin(), map.png.end());
  return cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
}

/// B, G, R, A at this point of the map.
cv::Vec4b at(const station::StationMap& map, const cv::Mat& picture, double x, double y) {
  const int column = static_cast<int>(std::floor((x - map.origin.x()) / map.resolution));
  const int row = picture.rows - 1 - static_cast<int>(std::floor((y - map.origin.y()) / map.resolution));
  return picture.at<cv::Vec4b>(row, column);
}

SemanticModel site() {
  SemanticModel model;
  ModelEntity floor = test::wall("floor", 2, 1, 0, 8);
  floor.label = EntityLabel::floor;
  floor.size = {8, 6, 0.1};
  model.entities = {test::wall("east", 4, 2, std::numbers::pi / 2, 3), floor};
  return model;
}

TEST(SiteMap, WallsAreDarkOnALightFloor) {
  const auto map = draw_site_map(site());
  ASSERT_TRUE(map);
  const cv::Mat picture = picture_of(*map);
  ASSERT_EQ(picture.channels(), 4);
  EXPECT_EQ(map->resolution, 0.05);
  EXPECT_LT(at(*map, picture, 4, 1)[0], 100);
  EXPECT_LT(at(*map, picture, 4, 3)[0], 100);
  EXPECT_GT(at(*map, picture, 3, 2)[0], 200) << "west of it";
  EXPECT_GT(at(*map, picture, 4, -0.5)[0], 200) << "south of it: up is north";
  EXPECT_EQ(at(*map, picture, -2.3, 1)[3], 0) << "nothing is known there";
}

TEST(SiteMap, ALargeSiteUsesLargerPixels) {
  SemanticModel model = site();
  model.entities.push_back(test::wall("far", 900, 0, 0, 10));
  const auto map = draw_site_map(model);
  ASSERT_TRUE(map);
  const cv::Mat picture = picture_of(*map);
  EXPECT_LE(std::max(picture.rows, picture.cols), 4096);
  EXPECT_GT(map->resolution, 0.2);
  EXPECT_LT(at(*map, picture, 900, 0)[0], 100);
}

TEST(SiteMap, AnEmptySiteGivesNoMap) { EXPECT_FALSE(draw_site_map({})); }

}  // namespace
}  // namespace parhelion::tools
