// The exported model, read back according to the glTF 2.0 specification.
#include "tools/map/gltf.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "protocols/yaml/base64.hpp"
#include "tests/box_mesh.hpp"

namespace parhelion::tools {
namespace {

SemanticModel model() {
  SemanticModel result;
  ModelEntity wall;
  wall.name = "wall 1";
  wall.label = EntityLabel::wall;
  wall.T_map_body = Transform<Map, Body>::planar(1, 2, 0.5, 1.25);
  wall.size = {4, 0.1, 2.5};
  result.entities = {wall, wall};
  result.entities[1].name = "gone";
  result.entities[1].deleted = true;
  wall.name = "table";
  result.meshes = {test::box_mesh(wall)};
  return result;
}

TEST(Gltf, HasANodeForEachEntityAndMeshWithNameAndColour) {
  const auto json = nlohmann::json::parse(to_gltf(model()));
  EXPECT_EQ(json["asset"]["version"], "2.0");
  ASSERT_EQ(json["nodes"].size(), 3U) << "wall, table and the root";
  const auto& wall = json["nodes"][0];
  EXPECT_EQ(wall["name"], "wall 1");
  EXPECT_EQ(wall["extras"]["label"], "wall");
  EXPECT_EQ(wall["scale"], nlohmann::json({4.0, 0.1, 2.5}));
  EXPECT_NEAR(wall["rotation"][2].get<double>(), std::sin(0.25), 1e-12);
  EXPECT_EQ(json["nodes"][1]["name"], "table");
  const auto& root = json["nodes"][json["scenes"][0]["nodes"][0].get<std::size_t>()];
  EXPECT_EQ(root["children"], nlohmann::json({0, 1}));
  const std::size_t material = json["meshes"][0]["primitives"][0]["material"];
  EXPECT_EQ(json["materials"][material]["name"], "wall");
}

TEST(Gltf, AccessorsFitTheBufferAndTheirBounds) {
  const auto json = nlohmann::json::parse(to_gltf(model()));
  const std::string uri = json["buffers"][0]["uri"];
  const auto bytes = yaml::from_base64(std::string_view(uri).substr(uri.find(',') + 1));
  ASSERT_TRUE(bytes);
  ASSERT_EQ(bytes->size(), json["buffers"][0]["byteLength"].get<std::size_t>());
  for (const auto& accessor : json["accessors"]) {
    const auto& view = json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    const std::size_t offset = view["byteOffset"], length = view["byteLength"], count = accessor["count"];
    const bool vectors = accessor["type"] == "VEC3";
    EXPECT_EQ(length, count * (vectors ? 12 : 4));
    EXPECT_EQ(offset % 4, 0U);
    ASSERT_LE(offset + length, bytes->size());
    if (!vectors) continue;
    for (std::size_t i = 0; i < 3 * count; ++i) {
      float value = 0;
      std::memcpy(&value, bytes->data() + offset + 4 * i, 4);
      EXPECT_GE(value, accessor["min"][i % 3].get<float>());
      EXPECT_LE(value, accessor["max"][i % 3].get<float>());
    }
  }
}

TEST(Gltf, AnEmptyModelIsStillADocument) {
  const auto json = nlohmann::json::parse(to_gltf({}));
  EXPECT_EQ(json["nodes"].size(), 1U);
  EXPECT_FALSE(json.contains("buffers"));
}

}  // namespace
}  // namespace parhelion::tools
