// The plan of a model: drawn from its entities, and an error for an empty one.
#include "fusion/semantic/pictures/model_plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "fusion/semantic/pictures/plan_view.hpp"
#include "tests/model_box.hpp"

namespace parhelion::semantic {
namespace {

using ::testing::HasSubstr;

SemanticModel model_of_a_room() {
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
  const cv::Mat with = drawn(model_of_a_room());
  ASSERT_FALSE(with.empty());
  EXPECT_EQ(with.cols, 1000);
  const cv::Vec3b wall(104, 84, 72), door(16, 137, 214);
  EXPECT_GT(pixels_near(with, wall), 5000U);
  EXPECT_GT(pixels_near(with, door), 300U);
  SemanticModel without = model_of_a_room();
  without.entities[3].deleted = true;
  EXPECT_EQ(pixels_near(drawn(without), door), 0U) << "what is deleted is not drawn";
}

TEST(ModelPlan, GivesThePixelsThatItWrites) {
  const cv::Mat written = drawn(model_of_a_room());
  auto pixels = draw_model_plan(model_of_a_room(), {"Room", "a test", 1000});
  ASSERT_TRUE(pixels.ok());
  const cv::Mat given(pixels->height, pixels->width, CV_8UC3, pixels->bgr.data());
  ASSERT_EQ(given.size(), written.size());
  EXPECT_EQ(cv::norm(given, written, cv::NORM_INF), 0);
  EXPECT_EQ(draw_model_plan({}, {}).error().message, "plan: the model has nothing to draw");
}

std::vector<std::string> names_in(const SemanticModel& model) {
  std::vector<std::string> all;
  for (const ModelEntity& entity : model.entities) all.push_back(entity.name);
  return all;
}

TEST(MainPartOfAModel, ContainsEntitiesNearTheFloorsAndEachOther) {
  SemanticModel model = model_of_a_room();
  model.entities.push_back(test::model_box("porch", EntityLabel::wall, {5, 0, 1}, {0.1, 4, 2}));
  model.entities.push_back(test::model_box("shed", EntityLabel::unknown, {7.5, 0, 1}, {0.5, 1, 2}));
  model.entities.push_back(test::model_box("far wall", EntityLabel::wall, {30, 20, 1}, {6, 0.1, 2}));
  model.meshes.resize(1);
  model.meshes[0].vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {40, 9, 0}, {41, 9, 0}};
  model.meshes[0].triangles = {{0, 1, 2}, {2, 3, 4}};
  const MainPart shown = main_part(model);
  EXPECT_THAT(names_in(shown.model),
              testing::ElementsAre("floor", "wall 1", "wall 2", "door 1", "porch", "shed"));
  EXPECT_EQ(shown.left_out, "1 part farther out not shown");
  EXPECT_EQ(shown.model.meshes[0].triangles.size(), 1U);
  EXPECT_LT(plan_box(shown.model).max().x(), 9.5) << "what is left out does not make the rest small";
}

TEST(MainPartOfAModel, ContainsAllWhenLittleLiesOutside) {
  SemanticModel model = model_of_a_room();
  model.entities.push_back(test::model_box("hut", EntityLabel::unknown, {7.5, 0, 1}, {1, 1, 2}));
  EXPECT_EQ(names_in(main_part(model).model).size(), 5U);
  EXPECT_EQ(main_part(model).left_out, "");
  model.entities = {test::model_box("wall", EntityLabel::wall, {0, 0, 1}, {5, 0, 2})};
  EXPECT_EQ(main_part(model).model.entities.size(), 1U) << "a wall of no area";
  EXPECT_TRUE(main_part({}).model.entities.empty());
  EXPECT_TRUE(plan_box({}).isEmpty());
}

TEST(ModelPlan, ReportsErrors) {
  const auto error = [](const SemanticModel& model, const ModelPlan& plan, const std::string& path) {
    const Status status = draw_model_plan(model, plan, path);
    return status ? std::string() : status.error().message;
  };
  EXPECT_THAT(error({}, {}, "p.png"), HasSubstr("nothing to draw"));
  EXPECT_THAT(error(model_of_a_room(), {"", "", 10}, "p.png"), HasSubstr("400 <= width"));
  EXPECT_THAT(error(model_of_a_room(), {}, "/nowhere/at/all/p.png"), HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace parhelion::semantic
