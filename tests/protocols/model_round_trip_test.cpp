// parse(to_yaml(x)) == x, to the bit, for any valid model.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "any_values.hpp"
#include "protocols/model.hpp"

namespace parhelion {
namespace {

using namespace test;

ModelMesh any_mesh() {
  ModelMesh mesh;
  mesh.name = "mesh" + text();
  const int vertices = *rc::gen::inRange(0, 40);
  for (int i = 0; i < vertices; ++i)
    mesh.vertices.emplace_back(between_floats(-1e6, 1e6), between_floats(-9, 9), between_floats(-1e-9, 1));
  for (int i = vertices == 0 ? 0 : *rc::gen::inRange(0, 40); i > 0; --i) {
    const auto vertex = [&] { return static_cast<std::uint32_t>(*rc::gen::inRange(0, vertices)); };
    mesh.triangles.push_back({vertex(), vertex(), vertex()});
  }
  return mesh;
}

RC_GTEST_PROP(RoundTrip, Model, ()) {
  SemanticModel a;
  a.map_id = text();
  a.source = text();
  for (int i = *rc::gen::inRange(0, 6); i > 0; --i) {
    ModelEntity entity;
    entity.name = "wall " + std::to_string(i);
    entity.label = any_of<EntityLabel>(10);
    entity.T_map_body = any_pose<Map, Body>();
    // Far apart from the others, so that none overlap.
    auto place = entity.T_map_body.isometry();
    place.translation().z() = 1e5 * i;
    entity.T_map_body = Transform<Map, Body>(place);
    entity.size = {between(1e-3, 9e3), between(1e-3, 9e3), between(1e-3, 9e3)};
    entity.confidence = between(0, 1);
    entity.is_virtual = *rc::gen::arbitrary<bool>();
    entity.material.albedo = {between_floats(0, 1), between_floats(0, 1), between_floats(0, 1)};
    entity.material.roughness = between_floats(0, 1);
    entity.material.metallic = between_floats(0, 1);
    entity.material.laser_reflectivity = between_floats(0, 1);
    entity.part_of = text();
    if (entity.label == EntityLabel::door && *rc::gen::arbitrary<bool>()) {
      const double lower = between(-6, 6);
      const double upper = between(lower, 6);
      entity.hinge = {{finite(), finite()}, lower, upper, between(lower, upper)};
    }
    entity.observed = between(0, 1);
    entity.locked = *rc::gen::arbitrary<bool>();
    entity.deleted = *rc::gen::arbitrary<bool>();
    a.entities.push_back(entity);
  }
  for (std::size_t i = 1; i < a.entities.size(); ++i) {
    a.relations.push_back(
        {any_of<RelationKind>(7), a.entities[i].name, a.entities[i - 1].name, between(0, 1)});
  }
  for (int i = *rc::gen::inRange(0, 3); i > 0; --i) a.meshes.push_back(any_mesh());
  a.T_map_cloud = any_pose<Map, Cloud>();
  const auto b = parse_model(to_yaml(a), "m.yaml");
  RC_ASSERT(b.ok());
  RC_ASSERT(same(b->T_map_cloud, a.T_map_cloud));
  RC_ASSERT(b->relations.size() == a.relations.size());
  for (std::size_t i = 0; i < a.relations.size(); ++i) {
    const Relation &x = a.relations[i], &y = b->relations[i];
    RC_ASSERT(x.kind == y.kind && x.from == y.from && x.to == y.to && x.confidence == y.confidence);
  }
  RC_ASSERT(b->meshes.size() == a.meshes.size());
  for (std::size_t i = 0; i < a.meshes.size(); ++i) {
    RC_ASSERT(b->meshes[i].name == a.meshes[i].name && b->meshes[i].vertices == a.meshes[i].vertices);
    RC_ASSERT(b->meshes[i].triangles == a.meshes[i].triangles);
  }
  RC_ASSERT(b->map_id == a.map_id && b->source == a.source);
  RC_ASSERT(b->entities.size() == a.entities.size());
  for (std::size_t i = 0; i < a.entities.size(); ++i) {
    const ModelEntity &x = a.entities[i], &y = b->entities[i];
    RC_ASSERT(x.name == y.name && x.label == y.label && x.is_virtual == y.is_virtual);
    RC_ASSERT(same(x.T_map_body, y.T_map_body));
    RC_ASSERT(x.size == y.size && x.confidence == y.confidence);
    RC_ASSERT(x.material.albedo == y.material.albedo);
    RC_ASSERT(x.material.roughness == y.material.roughness && x.material.metallic == y.material.metallic);
    RC_ASSERT(x.material.laser_reflectivity == y.material.laser_reflectivity);
    RC_ASSERT(x.part_of == y.part_of && x.observed == y.observed);
    RC_ASSERT(x.locked == y.locked && x.deleted == y.deleted);
    RC_ASSERT(x.hinge.has_value() == y.hinge.has_value());
    if (x.hinge) {
      RC_ASSERT(x.hinge->axis == y.hinge->axis);
      RC_ASSERT(x.hinge->lower == y.hinge->lower && x.hinge->upper == y.hinge->upper);
      RC_ASSERT(x.hinge->closed == y.hinge->closed);
    }
  }
}

TEST(RoundTrip, AnglesWrittenByPeopleAreUnchanged) {
  const auto model = parse_model(
      "entities:\n  - {name: w, label: wall, pose: {x: 1 m, yaw: 33.5 deg}, size: [1 m, 1 m, 1 m]}", "m");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_NE(to_yaml(*model).find("pose: {x: 1 m, y: 0 m, yaw: 33.5 deg}"), std::string::npos)
      << to_yaml(*model);
}

}  // namespace
}  // namespace parhelion
