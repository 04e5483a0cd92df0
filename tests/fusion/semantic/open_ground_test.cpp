// What is outdoors: wide grounds without a ceiling, away from walls on most sides.
#include "fusion/semantic/objects/open_ground.hpp"

#include <gtest/gtest.h>

#include "tests/model_box.hpp"

namespace parhelion::semantic {
namespace {

using test::model_box;

std::vector<ModelEntity> street(double wide) {
  return {model_box("street", EntityLabel::floor, {0, 0, -0.05}, {40, wide, 0.1}),
          model_box("facade", EntityLabel::wall, {0, wide / 2, 3}, {40, 0.04, 6})};
}

TEST(OpenGround, AStreetBesideAFacadeIsOpen) {
  const OpenGround open(street(12));
  EXPECT_TRUE(open.contains({3, 0}));
  EXPECT_TRUE(open.contains({3, 5.5}));
}

TEST(OpenGround, ARoomAtTheStreetIsNot) {
  std::vector<ModelEntity> entities = street(12);
  for (const double side : {-1.0, 1.0}) {
    entities.push_back(model_box("wall", EntityLabel::wall, {3 * side, 9, 1.5}, {0.04, 6, 3}));
    entities.push_back(model_box("wall", EntityLabel::wall, {0, 9 + 3 * side, 1.5}, {6, 0.04, 3}));
  }
  const OpenGround open(entities);
  EXPECT_FALSE(open.contains({1, 8}));
  EXPECT_TRUE(open.contains({10, 0}));
}

TEST(OpenGround, ASmallSiteOrOneWithACeilingIsNot) {
  EXPECT_FALSE(OpenGround(street(2.5)).contains({3, 0}));
  std::vector<ModelEntity> hall = street(12);
  hall.push_back(model_box("ceiling", EntityLabel::ceiling, {0, 0, 6.05}, {40, 12, 0.1}));
  EXPECT_FALSE(OpenGround(hall).contains({3, 0}));
}

}  // namespace
}  // namespace parhelion::semantic
