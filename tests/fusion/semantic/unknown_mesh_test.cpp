// The mesh of unlabelled points: near the points, closed from both sides, within the size limit.
#include "fusion/semantic/unknown_mesh.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "protocols/model_mesh.hpp"

namespace parhelion::semantic {
namespace {

constexpr auto kUnknown = static_cast<std::uint8_t>(EntityLabel::unknown);

/// Points on the surface of a box from the origin to `size`, 2 cm apart, with some noise.
cloud::PointCloud<Map> scanned_box(const Eigen::Vector3d& size, double noise = 0.003) {
  cloud::PointCloud<Map> cloud;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> jitter(-noise, noise);
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const double side : {0.0, size[axis]}) {
      for (double a = 0; a <= size[u]; a += 0.02) {
        for (double b = 0; b <= size[v]; b += 0.02) {
          Eigen::Vector3d p;
          p[axis] = side + jitter(random), p[u] = a, p[v] = b;
          cloud.points.push_back(p.cast<float>());
        }
      }
    }
  }
  return cloud;
}

TEST(UnknownMesh, CoversThePointsWithinOneCube) {
  const cloud::PointCloud<Map> cloud = scanned_box({1.2, 0.6, 0.75});
  const std::vector<std::uint8_t> labels(cloud.size(), kUnknown);
  const auto result = unknown_mesh(cloud, labels);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_TRUE(check_mesh(result->mesh).ok());
  EXPECT_LT(result->left_out, cloud.size() / 500);
  const double cube = result->cube;
  for (const Eigen::Vector3f& v : result->mesh.vertices) {
    double nearest = 1e9;
    for (const Eigen::Vector3f& p : cloud.points) nearest = std::min(nearest, double{(p - v).norm()});
    EXPECT_LT(nearest, cube);
  }
  for (std::size_t i = 0; i < cloud.size(); i += 37) {
    double nearest = 1e9;
    for (const Eigen::Vector3f& v : result->mesh.vertices)
      nearest = std::min(nearest, double{(cloud.points[i] - v).norm()});
    EXPECT_LT(nearest, std::sqrt(3.0) * cube);
  }
}

TEST(UnknownMesh, IsClosedWithEachEdgeUsedInBothDirections) {
  const cloud::PointCloud<Map> cloud = scanned_box({0.8, 0.5, 0.4});
  const std::vector<std::uint8_t> labels(cloud.size(), kUnknown);
  const auto result = unknown_mesh(cloud, labels);
  ASSERT_TRUE(result);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : result->mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto a = t[i], b = t[(i + 1) % 3];
      edges[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  for (const auto& [edge, balance] : edges) EXPECT_EQ(balance, 0);
}

TEST(UnknownMesh, UsesOnlyUnknownPointsAndOmitsSpeckles) {
  cloud::PointCloud<Map> cloud = scanned_box({0.8, 0.5, 0.4});
  std::vector<std::uint8_t> labels(cloud.size(), static_cast<std::uint8_t>(EntityLabel::wall));
  auto none = unknown_mesh(cloud, labels);
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->mesh.empty());
  for (int i = 0; i < 20; ++i) {
    cloud.points.emplace_back(5.01F, 5.01F, 1.01F);
    labels.push_back(kUnknown);
  }
  none = unknown_mesh(cloud, labels);
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->mesh.empty()) << "one cube alone in the air is noise";
  EXPECT_EQ(none->left_out, 20U);
}

TEST(UnknownMesh, StaysWithinTheTriangleLimitByUsingLargerCubes) {
  const cloud::PointCloud<Map> cloud = scanned_box({3, 2, 1});
  const std::vector<std::uint8_t> labels(cloud.size(), kUnknown);
  UnknownMeshOptions options;
  options.max_triangles = 2000;
  options.triangles_per_m2 = 0;
  const auto result = unknown_mesh(cloud, labels, options);
  ASSERT_TRUE(result);
  EXPECT_LE(result->mesh.triangles.size(), 2000U);
  EXPECT_GT(result->cube, options.cube);
}

TEST(UnknownMesh, RefusesMismatchedInput) {
  const cloud::PointCloud<Map> cloud = scanned_box({0.5, 0.5, 0.5});
  EXPECT_FALSE(unknown_mesh(cloud, std::vector<std::uint8_t>(3)));
  UnknownMeshOptions options;
  options.cube = 0;
  EXPECT_FALSE(unknown_mesh(cloud, std::vector<std::uint8_t>(cloud.size()), options));
}

TEST(UnknownMesh, ALargeSiteHasTheResolutionOfASmallOne) {
  const cloud::PointCloud<Map> one = scanned_box({1.2, 0.6, 0.75});
  cloud::PointCloud<Map> many;
  for (int i = 0; i < 30; ++i) {
    for (const Eigen::Vector3f& p : one.points)
      many.points.push_back(
          p + Eigen::Vector3f(4.F * static_cast<float>(i % 6), 4.F * static_cast<float>(i / 6), 0));
  }
  UnknownMeshOptions options;
  options.max_triangles = 2000;
  const auto small = unknown_mesh(one, std::vector<std::uint8_t>(one.size(), kUnknown), options);
  const auto large = unknown_mesh(many, std::vector<std::uint8_t>(many.size(), kUnknown), options);
  ASSERT_TRUE(small && large);
  EXPECT_EQ(small->cube, options.cube);
  EXPECT_EQ(large->cube, options.cube);
  EXPECT_GT(large->mesh.triangles.size(), 20 * small->mesh.triangles.size());
}

}  // namespace
}  // namespace parhelion::semantic
