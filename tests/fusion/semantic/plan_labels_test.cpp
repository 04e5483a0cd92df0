// Labels in a plan: without overlap, and not over what is drawn.
#include "fusion/semantic/pictures/plan_labels.hpp"

#include <gtest/gtest.h>

#include "tests/model_box.hpp"

namespace parhelion::semantic {
namespace {

const Eigen::AlignedBox2d kView(Eigen::Vector2d(-5, -5), Eigen::Vector2d(5, 5));
constexpr Colour kInk{0, 0, 0};

TEST(PlanLabels, AreLeftOutWhereEveryPlaceIsTaken) {
  PlanCanvas canvas(1000, kView, 80, 60);
  PlanLabels labels(canvas);
  const ModelEntity chair = test::model_box("chair 1", EntityLabel::unknown, {0, 0, 0.5}, {0.2, 0.2, 1});
  int written = 0;
  while (written < 100 && labels.beside(chair, "chair 1", 10, kInk)) ++written;
  EXPECT_GE(written, 2);
  EXPECT_LT(written, 20) << "labels would overlap";
}

TEST(PlanLabels, AreLeftOutWhereTheyWouldHideMoreThanAllowed) {
  PlanCanvas canvas(1000, kView, 80, 60);
  PlanLabels labels(canvas);
  for (double x = -2; x < 2; x += 0.2) labels.keep_clear({{x, -2}, {x, 2}});
  const ModelEntity chair = test::model_box("chair 1", EntityLabel::unknown, {0, 0, 0.5}, {0.2, 0.2, 1});
  EXPECT_FALSE(labels.beside(chair, "chair 1", 10, kInk, 3));
  EXPECT_TRUE(labels.beside(chair, "chair 1", 10, kInk, 1000));
}

}  // namespace
}  // namespace parhelion::semantic
