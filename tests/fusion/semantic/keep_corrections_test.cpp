// A user's corrections of a model are kept when it is rebuilt.
#include "fusion/semantic/keep_corrections.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/model_box.hpp"

namespace parhelion::semantic {
namespace {

using ::testing::ElementsAre;

/// Two walls, a door in the first, and their relation.
SemanticModel found(double noise = 0) {
  SemanticModel model;
  model.entities = {test::model_box("wall 1", EntityLabel::wall, {0, noise, 1.25}, {4 + noise, 0.1, 2.5}),
                    test::model_box("wall 2", EntityLabel::wall, {2, 2 + noise, 1.25}, {0.1, 4, 2.5}),
                    test::model_box("door 1", EntityLabel::door, {1 + noise, noise, 1}, {0.9, 0.1, 2})};
  model.relations = {{RelationKind::orthogonal, "wall 1", "wall 2", 0.9},
                     {RelationKind::available_inside, "door 1", "wall 1", 0.8}};
  return model;
}

const ModelEntity* by_name(const SemanticModel& model, const std::string& name) {
  for (const ModelEntity& e : model.entities) {
    if (e.name == name) return &e;
  }
  return nullptr;
}

TEST(KeepCorrections, AnOldModelWithoutCorrectionsChangesNothing) {
  SemanticModel made = found(0.01);
  const std::string before = to_yaml(made);
  const KeptCorrections kept = keep_corrections(found(), made);
  EXPECT_EQ(kept.locked + kept.deleted + kept.drawn, 0U);
  EXPECT_EQ(to_yaml(made), before);
}

TEST(KeepCorrections, ALockedEntityReplacesTheNewEntityAtItsPlace) {
  SemanticModel old = found();
  old.entities[2].name = "kitchen door";
  old.entities[2].label = EntityLabel::window;  // relabelled as well
  old.entities[2].locked = true;
  SemanticModel made = found(0.02);
  const KeptCorrections kept = keep_corrections(old, made);
  EXPECT_EQ(kept.locked, 1U);
  EXPECT_THAT(kept.replaced, ElementsAre("door 1"));
  ASSERT_EQ(made.entities.size(), 3U);
  const ModelEntity* door = by_name(made, "kitchen door");
  ASSERT_NE(door, nullptr);
  EXPECT_EQ(door->label, EntityLabel::window);
  EXPECT_EQ(door->T_map_body.translation().x(), 1) << "as the person left it";
  EXPECT_NE(by_name(made, "wall 1"), nullptr) << "its wall stays the new run's";
  EXPECT_EQ(by_name(made, "wall 1")->T_map_body.translation().y(), 0.02);
  EXPECT_EQ(made.relations.at(1).from, "kitchen door") << "relations follow the name";
  EXPECT_TRUE(parse_model(to_yaml(made), "m.yaml")) << parse_model(to_yaml(made), "m.yaml").error().message;
}

TEST(KeepCorrections, ADeletedEntityIsNotFoundAgain) {
  SemanticModel old = found();
  old.entities[1].deleted = true;
  SemanticModel made = found(0.02);
  keep_corrections(old, made);
  SemanticModel again = found(-0.02);  // and a third run
  keep_corrections(made, again);
  for (const SemanticModel& model : {made, again}) {
    ASSERT_EQ(model.entities.size(), 3U);
    std::size_t solid = 0;
    for (const ModelEntity& e : model.entities) solid += is_solid(e);
    EXPECT_EQ(solid, 2U);
    ASSERT_NE(by_name(model, "wall 2"), nullptr);
    EXPECT_TRUE(by_name(model, "wall 2")->deleted);
    EXPECT_EQ(model.relations.size(), 1U) << "those of what is gone are gone";
    EXPECT_TRUE(parse_model(to_yaml(model), "m.yaml"));
  }
}

TEST(KeepCorrections, AGlassWallIsKeptAndReplacesNothing) {
  SemanticModel old = found();
  old.entities.push_back(test::model_box("glass", EntityLabel::wall, {0, 0.05, 1.25}, {4, 0.1, 2.5}));
  old.entities.back().is_virtual = true;
  SemanticModel made = found(0.01);
  const KeptCorrections kept = keep_corrections(old, made);
  EXPECT_EQ(kept.drawn, 1U);
  EXPECT_EQ(made.entities.size(), 4U);
  EXPECT_TRUE(by_name(made, "glass")->is_virtual);
}

TEST(KeepCorrections, AUserGivenNameIsNotReused) {
  SemanticModel old = found();
  old.entities = {test::model_box("wall 1", EntityLabel::wall, {0, 9, 1.25}, {4, 0.1, 2.5})};
  old.entities[0].locked = true;
  old.relations.clear();
  SemanticModel made = found();
  keep_corrections(old, made);
  EXPECT_EQ(made.entities.size(), 4U);
  EXPECT_EQ(by_name(made, "wall 1")->T_map_body.translation().y(), 9);
  ASSERT_NE(by_name(made, "wall 1 (2)"), nullptr);
  EXPECT_EQ(made.relations.at(0).from, "wall 1 (2)");
  EXPECT_TRUE(parse_model(to_yaml(made), "m.yaml"));
}

TEST(KeepCorrections, AreShiftedWhenTheNewRunMovesTheFloorToZero) {
  SemanticModel old = found();
  old.entities[1].locked = true;
  SemanticModel made = found();
  for (ModelEntity& e : made.entities) e.T_map_body = e.T_map_body.moved_by({0, 0, 1.3});
  made.T_map_cloud = Transform<Map, Cloud>(Eigen::Isometry3d(Eigen::Translation3d(0, 0, 1.3)));
  const KeptCorrections kept = keep_corrections(old, made);
  EXPECT_THAT(kept.replaced, ElementsAre("wall 2"));
  EXPECT_DOUBLE_EQ(by_name(made, "wall 2")->T_map_body.translation().z(), 1.25 + 1.3);
}

}  // namespace
}  // namespace parhelion::semantic
