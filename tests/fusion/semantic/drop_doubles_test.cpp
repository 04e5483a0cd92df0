// A model has no two conflicting entities in one place.
#include "fusion/semantic/net/drop_doubles.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocols/model_overlap.hpp"
#include "tests/synthetic_site.hpp"

namespace parhelion::semantic {
namespace {

SemanticModel pillars(const std::vector<std::pair<double, double>>& x_and_confidence) {
  SemanticModel model;
  for (const auto& [x, confidence] : x_and_confidence) {
    const std::string name = "pillar " + std::to_string(model.entities.size() + 1);
    model.entities.push_back(test::model_box(name, EntityLabel::pillar, {x, 0, 1}, {0.4, 0.4, 2}));
    model.entities.back().confidence = confidence;
  }
  return model;
}

std::vector<std::string> names(const SemanticModel& model) {
  std::vector<std::string> result;
  for (const ModelEntity& entity : model.entities) result.push_back(entity.name);
  return result;
}

TEST(DropDoubles, KeepsTheMoreCertainDuplicateAndDropsOtherRelations) {
  SemanticModel model = pillars({{0, 0.6}, {0.05, 0.9}, {3, 0.5}});
  model.relations = {{RelationKind::equal_height, "pillar 1", "pillar 3", 1},
                     {RelationKind::equal_height, "pillar 2", "pillar 3", 1}};
  EXPECT_EQ(drop_doubles(model), 1U);
  EXPECT_THAT(names(model), ::testing::ElementsAre("pillar 2", "pillar 3"));
  ASSERT_EQ(model.relations.size(), 1U);
  EXPECT_EQ(model.relations[0].from, "pillar 2");
  EXPECT_TRUE(parse_model(to_yaml(model), "model").ok());
}

TEST(DropDoubles, KeepsGivenEntitiesOverMoreCertainNewOnes) {
  SemanticModel model = pillars({{0, 0.1}, {0.05, 0.9}});
  EXPECT_EQ(drop_doubles(model, 1), 1U);
  EXPECT_THAT(names(model), ::testing::ElementsAre("pillar 1"));
}

TEST(DropDoubles, KeepsOneOfManyAtOnePlace) {
  SemanticModel model = pillars({{0, 0.5}, {0.01, 0.5}, {0.02, 0.5}, {0.03, 0.5}, {5, 0.5}});
  EXPECT_EQ(drop_doubles(model), 3U);
  EXPECT_THAT(names(model), ::testing::ElementsAre("pillar 1", "pillar 5"));
  EXPECT_FALSE(find_overlap(model.entities));
}

}  // namespace
}  // namespace parhelion::semantic
