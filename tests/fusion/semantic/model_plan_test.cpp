// The plan of a model: drawn where the model says, and refused where it says nothing.
#include "fusion/semantic/model_plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "tests/model_box.hpp"

namespace parhelion {
namespace {

using ::testing::HasSubstr;

SemanticModel room() {
  SemanticModel model;
  model.entities = {test::model_box("floor", EntityLabel::floor, {0, 0, -0.05}, {6, 4, 0.1}),
                    test::model_box("wall 1", EntityLabel::wall, {0, 2, 1.25}, {6, 0.1, 2.5}),
                    test::model_box("wall 2", EntityLabel::wall, {0, -2, 1.25}, {6, 0.1, 2.5}),
                    test::model_box("door 1", EntityLabel::door, {1, -2, 1}, {0.9, 0.12, 2})};
  model.entities[3].hinge = Hinge{{-0.45, 0}, 0, 1.5};
  return model;
}

cv::Mat drawn(const SemanticModel& model) {
  const auto path = (std::filesystem::path(testing::TempDir()) / "model_plan.png").string();
  const Status status = draw_model_plan(model, {"Room", "a test", 1000}, path);
  EXPECT_TRUE(status.ok()) << (status ? "" : status.error().message);
  return cv::imread(path, cv::IMREAD_COLOR);
}

std::size_t pixels_near(const cv::Mat& picture, const cv::Vec3b& bgr) {
  std::size_t n = 0;
  for (int y = 80; y < picture.rows - 100; ++y) {
    for (int x = 0; x < picture.cols; ++x) n += cv::norm(picture.at<cv::Vec3b>(y, x), bgr) < 12;
  }
  return n;
}

TEST(ModelPlan, ShowsWallsAndDoorsInTheirColours) {
  const cv::Mat with = drawn(room());
  ASSERT_FALSE(with.empty());
  EXPECT_EQ(with.cols, 1000);
  const cv::Vec3b wall(104, 84, 72), door(16, 137, 214);
  EXPECT_GT(pixels_near(with, wall), 5000U);
  EXPECT_GT(pixels_near(with, door), 300U);
  SemanticModel without = room();
  without.entities[3].deleted = true;
  EXPECT_EQ(pixels_near(drawn(without), door), 0U) << "what is deleted is not drawn";
}

TEST(ModelPlan, SaysWhatIsWrong) {
  const auto error = [](const SemanticModel& model, const ModelPlan& plan, const std::string& path) {
    const Status status = draw_model_plan(model, plan, path);
    return status ? std::string() : status.error().message;
  };
  EXPECT_THAT(error({}, {}, "p.png"), HasSubstr("nothing to draw"));
  EXPECT_THAT(error(room(), {"", "", 10}, "p.png"), HasSubstr("400 <= width"));
  EXPECT_THAT(error(room(), {}, "/nowhere/at/all/p.png"), HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace parhelion
