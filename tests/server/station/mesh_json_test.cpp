// Robots' meshes as the page gets them.
#include "server/station/mesh_json.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

namespace parhelion::station {
namespace {

/// A sphere of 1 m radius of 2 * `rings` * `rings` triangles or so.
ShapeMesh sphere(std::uint32_t rings) {
  ShapeMesh mesh;
  for (std::uint32_t i = 0; i <= rings; ++i) {
    for (std::uint32_t k = 0; k <= rings; ++k) {
      const double a = std::numbers::pi * i / rings, b = 2 * std::numbers::pi * k / rings;
      mesh.vertices.push_back(
          Eigen::Vector3d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)).cast<float>());
      const std::uint32_t at = i * (rings + 1) + k;
      if (i == rings || k == rings) continue;
      mesh.triangles.push_back({at, at + rings + 1, at + 1});
      mesh.triangles.push_back({at + 1, at + rings + 1, at + rings + 2});
    }
  }
  return mesh;
}

TEST(MeshJson, HasAllTrianglesOfASmallMesh) {
  const ShapeMesh mesh = sphere(10);
  const auto json = nlohmann::json::parse(mesh_json(mesh));
  EXPECT_EQ(json["triangles"].size(), 3 * mesh.triangles.size());
  EXPECT_EQ(json["vertices"].size(), 3 * mesh.vertices.size());
  EXPECT_NEAR(json["vertices"][2].get<double>(), 1, 1e-4);
}

TEST(MeshJson, CoarsensALargeMeshAndKeepsItsSurface) {
  const auto json = nlohmann::json::parse(mesh_json(sphere(400)));
  EXPECT_LE(json["triangles"].size(), 3 * 20'000U);
  EXPECT_GT(json["triangles"].size(), 3 * 5'000U);
  const auto& vertices = json["vertices"];
  for (std::size_t i = 0; i + 2 < vertices.size(); i += 3) {
    const Eigen::Vector3d p(vertices[i], vertices[i + 1], vertices[i + 2]);
    ASSERT_NEAR(p.norm(), 1, 0.01);
  }
  for (const auto& corner : json["triangles"]) ASSERT_LT(3 * corner.get<std::size_t>(), vertices.size());
}

TEST(MeshJson, TheIdIsAFunctionOfTheContent) {
  ShapeMesh mesh = sphere(10);
  const std::string id = mesh_id(mesh);
  EXPECT_EQ(id, mesh_id(sphere(10)));
  EXPECT_EQ(id.size(), 16U);
  mesh.vertices[3].x() += 0.001F;
  EXPECT_NE(id, mesh_id(mesh));
}

}  // namespace
}  // namespace parhelion::station
