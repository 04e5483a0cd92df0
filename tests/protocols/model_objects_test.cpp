// Objects and doubts in a model's YAML.
#include "protocols/model_objects.hpp"

#include <gtest/gtest.h>

#include "protocols/model.hpp"
#include "tests/model_box.hpp"

namespace parhelion {
namespace {

ModelRemarks remarks() {
  ModelRemarks r;
  ModelObject chair;
  chair.name = "chair 1";
  chair.kind = ObjectKind::chair;
  chair.T_map_body = Transform<Map, Body>::planar(1, 2, 0.5, 0.45);
  chair.size = {0.5, 0.45, 0.9};
  chair.confidence = 0.8;
  chair.under = "table 1";
  chair.beside = {"table 1", "chair 2"};
  ModelObject car;
  car.name = "car 1", car.kind = ObjectKind::car, car.movable = false, car.on = "object 3";
  chair.mesh = {"chair 1", {{0, 0, 0}, {0.1F, 1.5F, 0}, {0, 1, 0.3F}}, {{0, 1, 2}}};
  ModelObject person;
  person.name = "person 1", person.kind = ObjectKind::person, person.posture = Posture::lying;
  r.objects = {chair, car, person};
  r.doubts = {{"wall 3", {1, -2, 0.5}, 1.25, "only 20 % of it was measured"}};
  return r;
}

std::string yaml_of(const ModelRemarks& r) {
  SemanticModel model;
  model.entities = {test::model_box("wall 3", EntityLabel::wall, {0, 0, 1}, {3, 0.1, 2})};
  return to_yaml(model) + to_yaml(r);
}

TEST(ModelObjects, AreReadAsTheyWereWritten) {
  const std::string yaml = yaml_of(remarks());
  ASSERT_TRUE(parse_model(yaml, "m.yaml"));
  const auto again = parse_remarks(yaml, "m.yaml");
  ASSERT_TRUE(again) << again.error().message;
  ASSERT_EQ(again->objects.size(), 3U);
  EXPECT_EQ(again->objects[0].name, "chair 1");
  EXPECT_EQ(again->objects[0].kind, ObjectKind::chair);
  EXPECT_EQ(again->objects[0].under, "table 1");
  EXPECT_EQ(again->objects[0].beside.size(), 2U);
  EXPECT_TRUE(again->objects[0].movable);
  EXPECT_EQ(again->objects[0].mesh.name, "chair 1");
  EXPECT_EQ(again->objects[0].mesh.vertices, remarks().objects[0].mesh.vertices);
  EXPECT_EQ(again->objects[0].mesh.triangles, remarks().objects[0].mesh.triangles);
  EXPECT_TRUE(again->objects[1].mesh.empty());
  EXPECT_EQ(again->objects[2].posture, Posture::lying);
  EXPECT_FALSE(again->objects[1].movable);
  EXPECT_EQ(again->objects[1].on, "object 3");
  ASSERT_EQ(again->doubts.size(), 1U);
  EXPECT_EQ(again->doubts[0].reason, "only 20 % of it was measured");
  EXPECT_DOUBLE_EQ(again->doubts[0].extent, 1.25);
  EXPECT_EQ(to_yaml(*again), to_yaml(remarks()));
}

TEST(ModelObjects, AModelNeedsNone) {
  const auto none = parse_remarks(yaml_of({}), "m.yaml");
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->objects.empty());
  EXPECT_TRUE(none->doubts.empty());
}

TEST(ModelObjects, AMeshWithAnInvalidVertexIsRefused) {
  ModelRemarks broken = remarks();
  broken.objects[0].mesh.triangles = {{0, 1, 3}};
  const auto read = parse_remarks(yaml_of(broken), "m.yaml");
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("mesh of 'chair 1': triangle 0: expected vertices < 3"),
            std::string::npos)
      << read.error().message;
}

TEST(ModelObjects, OnlyAPersonHasAPosture) {
  ModelRemarks sitting_chair = remarks();
  sitting_chair.objects[0].posture = Posture::sitting;
  const auto read = parse_remarks(yaml_of(sitting_chair), "m.yaml");
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("'posture': only a person has one"), std::string::npos);
}

TEST(ModelObjects, ANameIsTakenOnce) {
  ModelRemarks twice = remarks();
  twice.objects[1].name = "chair 1";
  const auto read = parse_remarks(yaml_of(twice), "m.yaml");
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("names must be unique"), std::string::npos);
}

}  // namespace
}  // namespace parhelion
