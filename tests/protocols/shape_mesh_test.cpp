#include "protocols/shape_mesh.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/shape_mesh.hpp"

namespace parhelion {
namespace {

TEST(ShapeMesh, MovesTheOriginToTheMiddleOfTheBoundingBox) {
  const auto mesh = make_shape_mesh({{1, 1, 1}, {3, 1, 1}, {1, 5, 1}, {1, 1, 2}}, {{0, 1, 2}, {0, 2, 3}});
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->center, Eigen::Vector3d(2, 3, 1.5));
  EXPECT_EQ(mesh->size, Eigen::Vector3d(2, 4, 1));
  EXPECT_EQ(mesh->mesh->vertices[0], Eigen::Vector3f(-1, -2, -0.5));
}

TEST(ShapeMesh, AFlatMeshHasAThickness) {
  const auto mesh = make_shape_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  ASSERT_TRUE(mesh.ok());
  EXPECT_GT(mesh->size.minCoeff(), 0);
}

TEST(ShapeMesh, TheTreeHoldsEachTriangleOnceInsideItsBoxes) {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<MeshTriangle> triangles;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const auto f = static_cast<float>(i);
    for (const float d : {0.F, 0.3F, 0.7F})
      vertices.emplace_back(std::sin(f) + d, std::cos(7 * f), f * 0.01F * d);
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const auto made = make_shape_mesh(vertices, triangles);
  ASSERT_TRUE(made.ok());
  const ShapeMesh& mesh = *made->mesh;
  std::vector<int> seen(mesh.triangles.size());
  for (const MeshNode& node : mesh.tree) {
    if (node.count == 0) {
      ASSERT_LT(node.first + 1, mesh.tree.size());
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      ++seen[i];
      for (const std::uint32_t v : mesh.triangles[i]) {
        EXPECT_TRUE((mesh.vertices[v].array() >= node.min.array()).all());
        EXPECT_TRUE((mesh.vertices[v].array() <= node.max.array()).all());
      }
    }
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(seen.size()));
}

TEST(ShapeMesh, InvalidMeshesAreRefused) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(make_shape_mesh({}, {}).ok());
  EXPECT_FALSE(make_shape_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}).ok());
  EXPECT_FALSE(make_shape_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 3}}).ok());
  EXPECT_FALSE(make_shape_mesh({{0, 0, 0}, {nan, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}).ok());
  EXPECT_FALSE(make_shape_mesh({{0, 0, 0}, {1e38F, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}).ok());
}

TEST(HullCorners, AreTheEightOfABox) {
  const Shape box = test::box_mesh_shape({1, 0.1, 3});
  const auto corners = hull_corners(box.mesh->vertices);
  EXPECT_EQ(corners.size(), 8U);
  for (const Eigen::Vector3d& corner : corners)
    EXPECT_TRUE(corner.cwiseAbs().isApprox(Eigen::Vector3d(0.5, 0.05, 1.5), 1e-6)) << corner.transpose();
}

}  // namespace
}  // namespace parhelion
