// Model files beyond their boxes: hinges, relations, meshes, user corrections; and invalid ones.
#include "protocols/model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocols/model_overlap.hpp"
#include "protocols/yaml/base64.hpp"
#include "tests/protocols/damaged_text.hpp"

namespace parhelion {
namespace {

using ::testing::HasSubstr;

std::string error_of_model(const std::string& yaml) {
  const auto model = parse_model(yaml, "m.yaml");
  return model ? "" : model.error().message;
}

const std::string kTwoEntities =
    "entities:\n"
    "  - {name: wall 1, label: wall, pose: {z: 1 m}, size: [4 m, 0.1 m, 2.5 m]}\n"
    "  - {name: door 1, label: door, pose: {z: 1 m}, size: [0.9 m, 0.1 m, 2 m]}\n";

/// A tetrahedron.
SemanticModel meshed() {
  SemanticModel model;
  model.meshes.push_back({"unknown 1",
                          {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}});
  return model;
}

TEST(ModelFile, ReadsFieldsThatAPersonMayCorrect) {
  const auto model = parse_model(
      "T_map_cloud: {z: 1.3 m, roll: 2 deg}\n"
      "entities:\n"
      "  - name: door 1\n    label: door\n    pose: {z: 1 m}\n    size: [0.9 m, 5 cm, 2 m]\n"
      "    hinge: {axis: [-45 cm, 0 m], lower: 0 deg, upper: 100 deg}\n"
      "    observed: 0.25\n    locked: true\n"
      "  - {name: step 1, label: stairs, part_of: stairs 1, pose: {}, size: [1 m, 1 m, 1 m], deleted: true}\n"
      "relations:\n"
      "  - {kind: above, from: step 1, to: door 1, confidence: 0.5}\n",
      "m.yaml");
  ASSERT_TRUE(model) << model.error().message;
  const ModelEntity& door = model->entities[0];
  ASSERT_TRUE(door.hinge);
  EXPECT_EQ(door.hinge->axis, Eigen::Vector2d(-0.45, 0));
  EXPECT_DOUBLE_EQ(door.hinge->upper, 100 * M_PI / 180);
  EXPECT_EQ(door.observed, 0.25);
  EXPECT_TRUE(door.locked);
  EXPECT_TRUE(model->entities[1].deleted);
  EXPECT_EQ(model->entities[1].part_of, "stairs 1");
  EXPECT_EQ(model->relations.at(0).kind, RelationKind::above);
  EXPECT_DOUBLE_EQ(model->T_map_cloud.translation().z(), 1.3);
}

TEST(ModelFile, FreeSpaceAndDeletedEntitiesAreNotSolid) {
  ModelEntity entity;
  EXPECT_TRUE(is_solid(entity));
  entity.deleted = true;
  EXPECT_FALSE(is_solid(entity));
  entity.deleted = false;
  entity.label = EntityLabel::free_space;
  EXPECT_FALSE(is_solid(entity));
}

TEST(ModelFile, ReportsErrorsWithTheirLine) {
  const std::string wall_with_hinge =
      "entities:\n  - {name: w, label: wall, pose: {}, size: [1 m, 1 m, 1 m],\n     hinge: {axis: [0 m, 0 "
      "m]}}";
  EXPECT_THAT(error_of_model(wall_with_hinge),
              HasSubstr("m.yaml:3: 'hinge': only a door has one, found it on a wall"));
  EXPECT_THAT(
      error_of_model("entities:\n  - {name: d, label: door, pose: {}, size: [1 m, 1 m, 1 m], hinge: {axis: "
                     "[0 m, 0 m], lower: 90 deg, upper: 0 deg}}"),
      HasSubstr("expected lower <= upper, found lower 90 deg and upper 0 deg"));
  EXPECT_THAT(
      error_of_model("entities:\n  - {name: d, label: door, pose: {}, size: [1 m, 1 m, 1 m], hinge: {axis: "
                     "[0 m, 0 m], uper: 90 deg}}"),
      HasSubstr("m.yaml:2: unknown key 'uper', did you mean 'upper'?"));
  EXPECT_THAT(
      error_of_model("entities:\n  - {name: d, label: door, pose: {}, size: [1 m, 1 m, 1 m], lokced: true}"),
      HasSubstr("did you mean 'locked'?"));
  EXPECT_THAT(error_of_model(kTwoEntities + "relations:\n  - {kind: above, from: door 1, to: wal 1}"),
              HasSubstr("m.yaml:5: relation 'above': there is no entity 'wal 1', did you mean 'wall 1'?"));
  EXPECT_THAT(error_of_model(kTwoEntities + "relations:\n  - {kind: above, from: door 1, to: door 1}"),
              HasSubstr("'door 1' with itself"));
  EXPECT_THAT(error_of_model(kTwoEntities + "relations:\n  - {kind: abov, from: door 1, to: wall 1}"),
              HasSubstr("did you mean 'above'?"));
  EXPECT_THAT(error_of_model(kTwoEntities + "relations:\n  - {kind: above, from: door 1, to: wall 1}\n"
                                            "  - {kind: above, from: door 1, to: wall 1}"),
              HasSubstr("m.yaml:6: relation 'above' from 'door 1' to 'wall 1' is given twice"));
}

TEST(ModelFile, FreeSpacesMayOverlapButWallsMayNot) {
  const auto twice = [](const std::string& label, const std::string& more = "") {
    const std::string rest = ", label: " + label + ", pose: {}, size: [1 m, 1 m, 2 m]";
    return error_of_model("entities:\n  - {name: a" + rest + "}\n  - {name: b" + rest + more + "}");
  };
  EXPECT_EQ(twice("free_space"), "");
  EXPECT_THAT(twice("wall_above_door"), HasSubstr("'b' overlaps 'a'"));
  EXPECT_EQ(twice("wall", ", deleted: true"), "") << "what a person deleted is in nobody's way";
}

TEST(ModelFile, MeshesAreWrittenInPlainYaml) {
  const std::string yaml = to_yaml(meshed());
  EXPECT_THAT(yaml, HasSubstr("vertices: !!binary |\n"));
  const auto model = parse_model(yaml, "m.yaml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->meshes.at(0).vertices, meshed().meshes[0].vertices);
  EXPECT_EQ(model->meshes.at(0).triangles, meshed().meshes[0].triangles);
  // 1.0F, 0, 0 in little-endian bytes, as `base64` prints them.
  const auto one = parse_model(
      "entities: []\nmeshes:\n  - {name: m, unit: m, vertices: !!binary AACAPwAAAAAAAAAA, triangles: "
      "!!binary ''}",
      "m.yaml");
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ(one->meshes.at(0).vertices.at(0), Eigen::Vector3f(1, 0, 0));
}

TEST(ModelFile, RefusesInconsistentMeshes) {
  const auto with = [](const std::string& vertices, const std::string& triangles) {
    return error_of_model("entities: []\nmeshes:\n  - name: m\n    unit: m\n    vertices: " + vertices +
                          "\n    triangles: " + triangles);
  };
  const std::string one = "!!binary AACAPwAAAAAAAAAA", none = "!!binary ''";
  EXPECT_EQ(with(one, none), "");
  EXPECT_THAT(with("AACAPwAAAAAAAAAA", none),
              HasSubstr("m.yaml:5: 'vertices': expected !!binary and base64"));
  EXPECT_THAT(with("!!binary AACAPwAAAAAAAA==", none),
              HasSubstr("m.yaml:5: 'vertices': expected a multiple of 12"));
  EXPECT_THAT(with("!!binary AACAPwAAA_AAAAAA", none), HasSubstr("base64, character 9: not one of"));
  EXPECT_THAT(with("!!binary AADAfwAAAAAAAAAA", none), HasSubstr("vertex 0: expected finite coordinates"));
  EXPECT_THAT(with(one, "!!binary AAAAAAEAAAAAAAAA"),
              HasSubstr("triangle 0: expected vertices < 1, found 1"));
  EXPECT_THAT(error_of_model("entities: []\nmap_id: !!binary AAAA"), HasSubstr("found !!binary"));
  EXPECT_THAT(error_of_model("entities: []\nmap_id: " + std::string(201, 'm')),
              testing::AllOf(HasSubstr("201 bytes, expected at most 200"), HasSubstr(":2")));
  EXPECT_TRUE(parse_model("entities: []\nmap_id: " + std::string(200, 'm'), "model").ok());
  EXPECT_THAT(error_of_model("entities: []\nmap_id: !!python/object AAAA"), HasSubstr("tags"));
  EXPECT_THAT(error_of_model("!!binary AAAA: 1\nentities: []"), HasSubstr("a key must be plain text"));
  EXPECT_THAT(
      error_of_model("entities: []\nmeshes:\n  - {name: m, unit: mm, vertices: !!binary '', triangles: "
                     "!!binary ''}"),
      HasSubstr("'unit': expected m"));
}

TEST(ModelFile, RefusesTooManyTriangles) {
  SemanticModel model = meshed();
  model.meshes[0].triangles.assign(1'000'001, {0, 1, 2});
  EXPECT_THAT(error_of_model(to_yaml(model)),
              HasSubstr("expected at most 1000000 triangles in all, found 1000001"));
}

TEST(ModelFile, FlippedBytesAndTruncationsNeverCrash) {
  SemanticModel model = meshed();
  model.entities.resize(3);
  for (std::size_t i = 0; i < 3; ++i) {
    model.entities[i].name = "door " + std::to_string(i);
    model.entities[i].label = EntityLabel::door;
    model.entities[i].hinge = Hinge{};
    model.entities[i].T_map_body = Transform<Map, Body>::planar(5.0 * static_cast<double>(i), 0, 0.3);
  }
  model.relations.push_back({RelationKind::parallel, "door 0", "door 1", 0.5});
  const std::string good = to_yaml(model);
  ASSERT_EQ(error_of_model(good), "");
  test::expect_damaged_text_is_refused(parse_model, good, "m.yaml");
}

TEST(Base64, AgreesWithTheTestVectorsOfRfc4648) {
  const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"}};
  for (const auto& [plain, encoded] : vectors) {
    const std::string text = plain;
    const std::vector<std::uint8_t> bytes(text.begin(), text.end());
    EXPECT_EQ(yaml::to_base64(bytes), encoded);
    const auto back = yaml::from_base64(encoded);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, bytes);
  }
}

TEST(Base64, RefusesInvalidEncodings) {
  for (const char* bad :
       {"Z", "Zg", "Zg=", "Zh==", "Zm9=", "====", "Zg===", "Zg==Zg==", "Zm9v=", "Z=g=", "Zm9v!"})
    EXPECT_FALSE(yaml::from_base64(bad)) << bad;
  EXPECT_TRUE(yaml::from_base64(" Zm\n9v\t"));
}

}  // namespace
}  // namespace parhelion
