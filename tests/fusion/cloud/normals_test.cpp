// Normals: algorithm 2 against principal components, on known planes and on real clouds.
#include "fusion/cloud/normals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "fusion/cloud/read_cloud.hpp"
#include "protocols/quantile.hpp"
#include "tests/recordings.hpp"

namespace parhelion::cloud {
namespace {

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1.0p-53; }

/// Points of a plane square of 2 m with noise, and its normal.
std::vector<Eigen::Vector3f> noisy_plane(const Eigen::Vector3d& normal, double sigma, int count) {
  std::mt19937_64 random(3);
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < count; ++i) {
    double gauss = -6;
    for (int k = 0; k < 12; ++k) gauss += uniform(random);
    const Eigen::Vector3d p = 2 * uniform(random) * u + 2 * uniform(random) * v + sigma * gauss * normal;
    points.push_back(p.cast<float>());
  }
  return points;
}

/// Degrees between directions, independent of sign.
std::vector<double> angles(const std::vector<Eigen::Vector3f>& normals, const auto& expected) {
  std::vector<double> result;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Eigen::Vector3f e = expected(i);
    if (normals[i].isZero() || e.isZero()) continue;
    result.push_back(std::acos(std::min(1.0F, std::abs(normals[i].dot(e)))) * 180 / std::numbers::pi);
  }
  return result;
}

TEST(Normals, OnAPlaneEqualThePlaneNormal) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.5, 0.8).normalized();
  const auto points = noisy_plane(normal, 0.003, 8'000);
  const auto expected = [&](std::size_t) { return Eigen::Vector3f(normal.cast<float>()); };
  for (const NormalMethod method : {NormalMethod::principal, NormalMethod::random_planes}) {
    NormalOptions options;
    options.method = method;
    const auto normals = estimate_normals(points, options);
    ASSERT_TRUE(normals.ok());
    auto off = angles(*normals, expected);
    ASSERT_EQ(off.size(), points.size());
    EXPECT_LT(quantile(off, 0.5), method == NormalMethod::principal ? 2.0 : 4.0);
    EXPECT_LT(quantile(off, 0.95), method == NormalMethod::principal ? 5.0 : 9.0);
    for (const Eigen::Vector3f& n : *normals) EXPECT_GE(n.z(), 0);
  }
}

TEST(Normals, RandomPlanesKeepNormalsSharpAtAnEdge) {
  // Two perpendicular planes: close to the edge a mean of both would be 45 degrees off.
  auto points = noisy_plane(Eigen::Vector3d::UnitX(), 0.002, 8'000);
  for (const Eigen::Vector3f& p : noisy_plane(Eigen::Vector3d::UnitZ(), 0.002, 8'000)) points.push_back(p);
  NormalOptions options;
  options.bucket_size = 0.1;
  const auto expected = [&](std::size_t i) {
    return i < 8'000 ? Eigen::Vector3f(Eigen::Vector3f::UnitX()) : Eigen::Vector3f(Eigen::Vector3f::UnitZ());
  };
  const auto principal = angles(*estimate_normals(points, options), expected);
  options.method = NormalMethod::random_planes;
  options.planes = 30;
  const auto random = angles(*estimate_normals(points, options), expected);
  const auto between = [](const std::vector<double>& off) {
    return std::count_if(off.begin(), off.end(), [](double a) { return a > 15 && a < 75; });
  };
  EXPECT_LT(2 * between(random), between(principal));
}

TEST(Normals, AreTheSameForAnyNumberOfThreads) {
  const auto points = noisy_plane(Eigen::Vector3d(0.1, 0.2, 0.9).normalized(), 0.01, 20'000);
  for (const NormalMethod method : {NormalMethod::principal, NormalMethod::random_planes}) {
    NormalOptions options;
    options.method = method;
    options.threads = 1;
    const auto one = estimate_normals(points, options);
    options.threads = 2;
    EXPECT_EQ(*one, *estimate_normals(points, options));
  }
}

TEST(Normals, BothMethodsAgreeOnRealScans) {
  const auto path = test::recording("3d-room-scan/room_scan1.pcd");
  PARHELION_NEEDS_RECORDING(path);
  const auto file = read_scan(path);
  ASSERT_TRUE(file.ok()) << file.error().message;
  const PointCloud<Scanner>* const cloud = &file->cloud;
  NormalOptions options;
  const auto principal = estimate_normals(cloud->points, options);
  options.method = NormalMethod::random_planes;
  const auto random = estimate_normals(cloud->points, options);
  auto off = angles(*random, [&](std::size_t i) { return (*principal)[i]; });
  std::printf("%zu points: methods differ by %.1f degrees (median), %.1f (75 %%), %.1f (90 %%)\n",
              cloud->points.size(), quantile(off, 0.5), quantile(off, 0.75), quantile(off, 0.9));
  // Far away, where scan lines are further apart than the neighbourhood's size, there is no normal.
  EXPECT_GT(off.size(), cloud->points.size() * 90 / 100);
  EXPECT_LT(quantile(off, 0.5), 5);
  EXPECT_LT(quantile(off, 0.75), 15);
}

TEST(Normals, AreUnknownWherePointsSpanNoPlane) {
  const std::vector<Eigen::Vector3f> same(1'000, Eigen::Vector3f(1, 2, 3));
  std::vector<Eigen::Vector3f> line;
  for (int i = 0; i < 1'000; ++i) line.emplace_back(0.01F * static_cast<float>(i), 0.0F, 0.0F);
  for (const NormalMethod method : {NormalMethod::principal, NormalMethod::random_planes}) {
    NormalOptions options;
    options.method = method;
    for (const auto& points : {same, line}) {
      const auto normals = estimate_normals(points, options);
      ASSERT_TRUE(normals.ok());
      for (const Eigen::Vector3f& n : *normals) EXPECT_TRUE(n.isZero());
    }
  }
}

TEST(Normals, FaceTheViewpointAndTolerateAnOutlier) {
  PointCloud<Cloud> cloud;
  cloud.points = noisy_plane(Eigen::Vector3d::UnitZ(), 0.002, 5'000);
  cloud.points.emplace_back(1e6F, 1e6F, -1e6F);
  cloud.viewpoints.emplace_back(0, 0, -2);
  ASSERT_TRUE(add_normals(cloud).ok());
  EXPECT_TRUE(cloud.normals.back().isZero());
  for (std::size_t i = 0; i + 1 < cloud.size(); ++i) EXPECT_LT(cloud.normals[i].z(), -0.9F);
}

TEST(Normals, InvalidInputIsRefused) {
  EXPECT_THAT(estimate_normals({}).error().message, testing::HasSubstr("empty"));
  NormalOptions options;
  options.planes = 0;
  const std::vector<Eigen::Vector3f> points(3, Eigen::Vector3f::Zero());
  EXPECT_THAT(estimate_normals(points, options).error().message, testing::HasSubstr("planes"));
}

}  // namespace
}  // namespace parhelion::cloud
