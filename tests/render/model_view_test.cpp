// The 3D picture of a model: labels are on visible entities, ceilings and deleted entities are left out.
#include "render/model_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/box_mesh.hpp"
#include "tests/model_box.hpp"
#include "tests/render/scenes.hpp"

namespace parhelion::render {
namespace {

using namespace test;
using ::testing::Contains;
using ::testing::Not;

SemanticModel room() {
  SemanticModel model;
  model.entities = {model_box("floor", EntityLabel::floor, {0, 0, -0.05}, {6, 4, 0.1}),
                    model_box("ceiling", EntityLabel::ceiling, {0, 0, 2.55}, {6, 4, 0.1}),
                    model_box("back", EntityLabel::wall, {0, 2, 1.25}, {6, 0.1, 2.5}),
                    model_box("side", EntityLabel::wall, {3, 0, 1.25}, {0.1, 4, 2.5}),
                    model_box("door 1", EntityLabel::door, {1, 1.92, 1}, {0.9, 0.1, 2})};
  return model;
}

std::size_t different(const ModelViewPixels& a, const ModelViewPixels& b) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < a.bgr.size(); i += 3) n += a.bgr[i] != b.bgr[i];
  return n;
}

TEST(ModelView, LabelsVisibleEntitiesAndOmitsTheCeiling) {
  const auto view = draw_model_view(room(), {});
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_EQ(view->bgr.size(), 3U * 1600 * 1000);
  EXPECT_THAT(view->named, Contains("door 1"));
  EXPECT_THAT(view->named, Contains("back"));
  EXPECT_THAT(view->named, Contains("floor"));
  EXPECT_THAT(view->named, Not(Contains("ceiling")));
}

TEST(ModelView, OmitsDeletedEntitiesAndDrawsMeshes) {
  const auto bare = draw_model_view(room(), {});
  SemanticModel less = room();
  less.entities[4].deleted = true;
  const auto without = draw_model_view(less, {});
  SemanticModel more = room();
  more.meshes.push_back(box_mesh(model_box("table", EntityLabel::unknown, {0, 0, 0.4}, {1.5, 0.8, 0.8})));
  const auto with = draw_model_view(more, {});
  ASSERT_TRUE(bare && without && with);
  EXPECT_THAT(without->named, Not(Contains("door 1")));
  EXPECT_GT(different(*bare, *with), 5000U);
}

TEST(ModelView, CutsWallsBetweenTheCameraAndTheMiddleAndNoOthers) {
  SemanticModel model;
  model.entities = {model_box("floor", EntityLabel::floor, {0, 0, -0.05}, {12, 10, 0.1}),
                    model_box("front", EntityLabel::wall, {4, -4, 1.25}, {6, 0.1, 2.5}),
                    model_box("flight", EntityLabel::stairs, {4, -3.15, 0.25}, {1, 0.5, 0.5}),
                    model_box("back", EntityLabel::wall, {4, 3, 1.25}, {6, 0.1, 2.5}),
                    model_box("behind", EntityLabel::stairs, {4, 3.85, 0.25}, {1, 0.5, 0.5})};
  const auto cut = draw_model_view(model, {});
  ModelView whole;
  whole.cut = 0;
  const auto uncut = draw_model_view(model, whole);
  ASSERT_TRUE(cut && uncut);
  EXPECT_THAT(cut->named, Contains("flight"));
  EXPECT_THAT(uncut->named, Not(Contains("flight"))) << "the front wall hides it";
  EXPECT_THAT(cut->named, Not(Contains("behind"))) << "the back wall hides nothing of the interior";
}

TEST(ModelView, ReportsErrors) {
  EXPECT_FALSE(draw_model_view({}, {}));
  ModelView tiny;
  tiny.width = 10;
  EXPECT_FALSE(draw_model_view(room(), tiny));
}

}  // namespace
}  // namespace parhelion::render
